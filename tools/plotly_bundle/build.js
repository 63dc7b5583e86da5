// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
"use strict";

// Makes plotly.min.js.gz and its licences: `npm install && npm run build`, in this folder.
const fs = require("fs");
const path = require("path");
const zlib = require("zlib");
const esbuild = require("esbuild");
const { environmentPlugin } = require("esbuild-plugin-environment");
const { glsl } = require("esbuild-plugin-glsl");
const inlineCss = require("esbuild-plugin-inline-css");

const target = path.join(__dirname, "..", "..", "python", "fastcal", "report", "plotly");
const version = require("plotly.js/package.json").version;

function licences(inputs) {
  const folders = new Set();
  for (const file of Object.keys(inputs)) {
    const found = /^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//.exec(file);
    if (found) folders.add(found[1]);
  }
  return [...folders].sort().map((folder) => {
    const about = JSON.parse(fs.readFileSync(path.join(folder, "package.json"), "utf8"));
    const file = fs.readdirSync(folder).find((name) => /^licen[cs]e/i.test(name));
    const text = file ? fs.readFileSync(path.join(folder, file), "utf8").trim() : `Licence: ${about.license}`;
    return `${about.name} ${about.version}\n\n${text}\n`;
  });
}

esbuild.build({
  entryPoints: [path.join(__dirname, "entry.js")],
  absWorkingDir: __dirname,
  format: "iife",
  globalName: "Plotly",
  bundle: true,
  minify: true,
  plugins: [inlineCss(), glsl({ minify: true }), environmentPlugin({ NODE_DEBUG: false })],
  alias: { regl: "@plotly/regl", stream: "stream-browserify" },
  define: { global: "window", "define.amd": "false" },
  target: "es2020",
  legalComments: "none",
  metafile: true,
  write: false,
}).then(({ outputFiles, metafile }) => {
  fs.mkdirSync(target, { recursive: true });
  fs.writeFileSync(path.join(target, "plotly.min.js.gz"), zlib.gzipSync(outputFiles[0].contents, { level: 9 }));
  const head = `plotly.min.js.gz holds parts of plotly.js ${version} and of the packages that they use.\n`;
  fs.writeFileSync(path.join(target, "LICENSES.txt"), [head, ...licences(metafile.inputs)].join(`\n${"-".repeat(72)}\n\n`));
});
