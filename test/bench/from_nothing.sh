#!/usr/bin/env bash
# from_nothing.sh FOLDER [COMMAND...]: times `./dev demo` and `./dev test`, or the commands given, on a bare Debian 12 that
# debootstrap makes in FOLDER (as root; removed at the end). Packages come from where this machine's do.
set -euo pipefail
root=${1:?FOLDER} source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
shift
[[ $# -gt 0 ]] || set -- "./dev demo" "./dev test"
command -v debootstrap >/dev/null || { echo "skipped: debootstrap is missing" >&2; exit 77; }
[[ ! -e $root ]] || { echo "$root is there already" >&2; exit 1; }

mirror=$({ cat /etc/apt/sources.list /etc/apt/sources.list.d/*.{list,sources} 2>/dev/null || true; } |
  sed -nE 's/^URIs: *([^ ]+).*/\1/p; s/^deb (\[[^]]*\] )?([^ ]+).*/\2/p' | sed -n 1p)
clean_up() {
  umount -l "$root/proc" "$root/dev" 2>/dev/null || true
  rm -rf --one-file-system "$root"
}
trap clean_up EXIT
debootstrap --variant=minbase --include=ca-certificates,git bookworm "$root" "$mirror" >/dev/null
cp -rL /etc/apt/. "$root/etc/apt"
cp -L /etc/resolv.conf /etc/hosts "$root/etc"
[[ ! -d /etc/ssl/certs ]] || cp -rL --remove-destination /etc/ssl/certs/. "$root/etc/ssl/certs"
mount -t proc proc "$root/proc"
mount --rbind --make-rslave /dev "$root/dev"
git clone -q "file://$source" "$root/octosurf"

count() { chroot "$root" dpkg-query -W -f '.' | wc -c; }
megabytes() { du -sxm "$@" | awk '{ sum += $1 } END { print sum }'; }
for command; do
  packages=$(count) before=$(megabytes "$root/usr" "$root/var") begun=$(date +%s)
  chroot "$root" env HOME=/root LANG=C.UTF-8 bash -c "cd /octosurf && $command" >"/tmp/from_nothing.$$" 2>&1 ||
    { tail -20 "/tmp/from_nothing.$$" >&2; echo "$command: failed" >&2; exit 1; }
  printf '{"command": "%s", "minutes": %s, "packages": %d, "packages_mb": %d, "build_mb": %d}\n' "$command" \
    "$(awk "BEGIN { printf \"%.1f\", ($(date +%s) - $begun) / 60 }")" $(($(count) - packages)) \
    $(($(megabytes "$root/usr" "$root/var") - before)) "$(megabytes "$root/octosurf/build")"
done
