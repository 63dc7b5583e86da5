# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The studio: a local web app beside the robot. A project is a folder of plain files, which the commands read too."""
