"""Prints the licences, with their texts, of all packages that are built into the program, or into the package given by
`--package NAME`."""

import json
import subprocess
import sys
from pathlib import Path


def cargo(*arguments):
    command = ["cargo", *arguments, "--locked"]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


TARGET = "x86_64-unknown-linux-gnu"
tree = cargo("tree", *sys.argv[1:], "-e", "normal", "--target", TARGET, "--prefix", "none", "-f", "{p}")
# A line is "NAME vVERSION", and more for what is not from the registry or was printed before.
built_in = {tuple(line.replace(" v", " ", 1).split()[:2]) for line in tree.splitlines() if line}

texts = {}
for package in json.loads(cargo("metadata", "--format-version", "1"))["packages"]:
    if (package["name"], package["version"]) not in built_in:
        continue
    folder = Path(package["manifest_path"]).parent
    named = f"{package['name']} {package['version']}"
    print(f"{named}: {package['license']}")
    for path in sorted(folder.rglob("*")):
        stem = path.name.upper()
        is_licence = stem.startswith(("LICENSE", "LICENCE", "COPYING", "NOTICE", "OFL", "UFL"))
        if is_licence and path.is_file() and package["source"]:
            texts.setdefault(path.read_text(errors="replace").strip(), []).append(named)

for text, owners in texts.items():
    print(f"\n{'=' * 80}\n{', '.join(sorted(set(owners)))}\n\n{text}")
