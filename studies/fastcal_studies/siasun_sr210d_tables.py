# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the SR210D paper prints in tables 4 and 6 and in 6.1, and what each line of its study was given."""

from fastcal_studies.exhibits import Cell

COUPLING = -2.5342e-4
RATIOS = (1.0002, 1.0013, 1.0004, 0.9998, 0.9996, 1.0003)
FLEXIBILITY = {2: 1.89e-5, 3: -2.49e-5, 4: -5.35e-5, 5: -8.26e-5}

_REFITTED = "fitted with the model"
TERMS: list[list[Cell]] = [
    ["geometry and ratios, the paper's", "50 free", "none", _REFITTED, "one fit"],
    ["stiffness, the paper's", "50 loaded, behind the former", "unknown: motor currents", "kept", "one fit"],
    ["BSO-MLP, the paper's", "200 loaded, behind the former", "unknown: motor currents", "kept",
     "a swarm of 30, 121 evaluations each; 400 epochs"],
    ["the same network from PSO, GA, ABC or at random", "the same", "the same", "kept",
     "as many evaluations, or none; 400 epochs"],
    ["BSO-MLP behind fastcal's model", "50 free, 50 and 200 loaded", "known: 210 kg", _REFITTED, "as the paper's"],
    ["fastcal's mlp behind the paper's model", "200 loaded, behind the former", "unknown: motor currents", "kept",
     "twice 150 epochs of three networks"],
    ["fastcal's best without load (table 5)", "50 free", "none", _REFITTED, "one fit; 60 steps of the likelihood"],
    ["fastcal's best of table 7", "50 free, 50 loaded", "known: 210 kg", _REFITTED, "the same"],
    ["fastcal's gp behind fastcal's model", "50 free, 50 and 200 loaded", "known: 210 kg", _REFITTED, "the same"],
    ["fastcal's mlp behind fastcal's model", "50 free, 50 and 200 loaded", "known: 210 kg", _REFITTED,
     "one fit; twice 150 epochs of three networks"],
    ["fastcal's gp by current", "50 free, 50 and 200 loaded", "unknown: motor currents", _REFITTED, "the same"],
]  # fmt: skip
