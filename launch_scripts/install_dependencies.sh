#!/usr/bin/env bash
# Installs the Debian 12 packages that the workspace needs. Says nothing when all are there.
set -euo pipefail

packages=(
  # tools
  g++ cmake ninja-build ccache
  colcon python3-colcon-cmake python3-colcon-metadata python3-colcon-recursive-crawl
  python3-colcon-package-selection python3-colcon-output python3-colcon-parallel-executor
  # bus; fastddsgen runs on Java but does not depend on it
  fastddsgen default-jre-headless fastdds-tools libfastrtps-dev libfastcdr-dev
  libsystemd-dev pkg-config prometheus-cpp-dev
  # packages and their man pages
  dpkg-dev file help2man
  # core
  libeigen3-dev libpcl-dev libopencv-dev libyaml-cpp-dev libspdlog-dev libcli11-dev libdlib-dev
  libpng-dev libjpeg-dev libzstd-dev liblz4-dev zlib1g-dev libxxhash-dev libsqlite3-dev libnanoflann-dev libboost-dev
  # simulator: rays on meshes
  libembree-dev
  # live page
  nlohmann-json3-dev libjs-three
  # tests and benchmarks
  libgtest-dev libbenchmark-dev iproute2 iptables openssl
  cyclonedds-dev cyclonedds-tools tshark python3-rosidl python3-empy
)

if [[ "${1:-}" == "--list" ]]; then
  printf '%s\n' "${packages[@]}"
  exit 0
elif [[ $# -gt 0 ]]; then
  echo "usage: install_dependencies.sh [--list]" >&2
  exit 2
fi

installed=$(dpkg-query --show --showformat='${db:Status-Abbrev}${Package}\n' "${packages[@]}" \
  2>/dev/null | sed -n 's/^ii *//p' || true)
missing=()
for package in "${packages[@]}"; do
  grep -qxF "$package" <<<"$installed" || missing+=("$package")
done
[[ ${#missing[@]} -eq 0 ]] && exit 0

if [[ "$(. /etc/os-release && echo "${ID:-}${VERSION_ID:-}")" != "debian12" ]]; then
  echo "install_dependencies.sh: made for Debian 12; missing here: ${missing[*]}" >&2
  exit 1
fi
as_root=()
if [[ $EUID -ne 0 ]]; then
  if ! command -v sudo >/dev/null; then
    echo "install_dependencies.sh: run as root (no sudo here) to install: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

echo "installing ${#missing[@]} Debian packages: ${missing[*]}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y \
    -o Dpkg::Use-Pty=0 -o DPkg::Lock::Timeout=600 -o Acquire::Retries=3 "$@" >"$log" 2>&1
}
for step in update "install --no-install-recommends ${missing[*]}"; do
  # shellcheck disable=SC2086  # words of a step are arguments
  if ! apt $step; then
    tail -n 20 "$log" >&2
    echo "install_dependencies.sh: apt-get ${step%% *} failed, see above" >&2
    exit 1
  fi
done
