#!/usr/bin/env bash
# Makes Debian packages of what build.sh has installed: pocd (the service), pocd-tools, libpocd-dev.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

prefix=install output=output/packages
usage() {
  echo "usage: package.sh [--prefix DIR] [--output DIR]"
  echo "  --prefix  where build.sh has installed; default: install"
  echo "  --output  where the packages go; default: output/packages"
}
while [[ $# -gt 0 ]]; do
  case "$1" in
    --prefix) shift && prefix=${1:?--prefix needs a folder} ;;
    --output) shift && output=${1:?--output needs a folder} ;;
    --help | -h) usage && exit 0 ;;
    *) usage >&2 && exit 2 ;;
  esac
  shift
done
[[ -x $prefix/bin/pocd_node ]] || { echo "package.sh: build first, launch_scripts/build.sh" >&2 && exit 1; }

mkdir -p "$output"
output=$(realpath "$output")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
log=$work/log
if ! { cmake -S launch_scripts/package -B "$work/build" "-DPOCD_PREFIX=$(realpath "$prefix")" &&
  (cd "$work/build" && cpack -B "$output"); } >"$log" 2>&1; then
  tail -n 30 "$log" >&2
  echo "package.sh: failed, see above" >&2
  exit 1
fi
rm -rf "$output/_CPack_Packages"
ls "$output"/*.deb
