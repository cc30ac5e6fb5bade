#!/usr/bin/env bash
# Opens the page, and recordings in Rerun's viewer, in a browser, and reads from pocd_view with other people's client of the
# Foxglove protocol.
# usage: run.sh BIN_DIR WORK_DIR TEST.js. Screenshots are kept in WORK_DIR/pictures. Exit code 77:
# skipped, there is no browser, no npm or no network.
set -euo pipefail

bin=$1 work=$2 script=$3
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
skip() {
  echo "view: skipped, $1"
  exit 77
}
command -v npm >/dev/null && command -v node >/dev/null || skip "npm and node are not installed"
chromium=$(command -v chromium || true)
[[ -n $chromium || $script == foxglove.js ]] || skip "Debian's chromium is not installed"
mkdir -p "$work"
cp "$here"/*.js "$work"
package=$here/package_${script%.js}.json
[[ -f $package ]] || package=$here/package.json
cp "$package" "$work/package.json"
cd "$work"
if ! npm install --no-audit --no-fund --loglevel=error >npm.log 2>&1; then
  tail -n 3 npm.log
  skip "npm cannot fetch its packages"
fi

# A domain that no other test uses, held by a lock on a file, as TestDomain does.
locks=${TMPDIR:-/tmp}/pocd_test_domains_$UID
mkdir -p "$locks"
for domain in $(seq 199 -1 100); do
  exec {lock}>"$locks/$domain"
  flock --nonblock "$lock" && break
  exec {lock}>&-
done
export ROS_DOMAIN_ID=$domain SKIP_DEFAULT_XML=1 FASTRTPS_DEFAULT_PROFILES_FILE=$here/../../launch_scripts/loopback.xml
POCD_BIN=$bin POCD_SOURCE=$here/../.. node "$script" "$chromium" "$work/pictures"
