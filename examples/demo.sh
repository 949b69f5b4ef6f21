#!/usr/bin/env bash
# What ./dev demo runs: an office with a stair is simulated, mapped, judged and drawn. Needs octosurf and octosurf-lab in PATH.
# usage: demo.sh FOLDER
set -euo pipefail
out=${1:?usage: demo.sh FOLDER}
mkdir -p "$out"
echo "== An office with a stair, tables and clutter, as a depth camera sees it"
octosurf-lab simulate office --seed 1 -o "$out/scans" --force
echo "== Its map"
octosurf map "$out/scans" -o "$out/office" --report "$out/report.json" --force
echo "== How good it is, against the simulation's truth"
octosurf-lab evaluate "$out/office" --truth "$out/scans/truth.json" | sed "1,/^$/d"
echo "== Files"
octosurf export "$out/office" --to "$out/office.json" --force
octosurf export "$out/office" --to "$out/office.glb" --what meshes --as-mapped --force
octosurf view "$out/office" --png "$out/office.png" --force
octosurf view "$out/office" --html "$out/office.html" --force || echo "no page; the line above says why"
cat <<END

Look at next:
  $out/office.html      the map in a browser
  $out/office.png       a picture of the surfaces
  $out/office.glb       the surfaces for a 3-D viewer; office.json for programs
  $out/office.bt        the octree for octovis
END
