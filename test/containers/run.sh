#!/usr/bin/env bash
# The component in containers, as it is deployed: the image of launch_scripts/Dockerfile, without any registry but
# Debian's, and node, robots, mirror and another vendor's DDS in a container each. By hand, not a part of test.sh:
# the image takes half an hour the first time.
# usage: run.sh [--image NAME | --packages FOLDER | --here] [--peer FILE] [--keep] [CASE...]
#   --image  an image that is there already; default: builds pocd-test
#   --packages  what package.sh has made of this tree: only the second stage of the Dockerfile is run, with them
#   --here   no image: the programs of install/bin with this machine's libraries, in containers of Debian's base;
#            what concerns the image itself is skipped
#   --peer   the program cyclone_peer of build.sh --tests; default: build/pocd_test/peers/cyclone_peer
#   --keep   leaves the image for the next run with --image pocd-test
# Cases: image packages host private_shm bridge hardened killed cut compose site_test; default: all.
# The last line is "N passed, N failed, N skipped"; the exit code is 0 when none failed.
set -euo pipefail
source=$(realpath "$(dirname "$0")/../..")

image="" packages="" here="" keep="" built="" peer=$source/build/pocd_test/peers/cyclone_peer cases=()
while [[ $# -gt 0 ]]; do
  case "$1" in
    --image) shift && image=${1:?--image needs a name} ;;
    --packages) shift && packages=$(realpath "${1:?--packages needs a folder}") ;;
    --here) here=yes ;;
    --peer) shift && peer=${1:?--peer needs a file} ;;
    --keep) keep=yes ;;
    -*) sed -n '2,14s/^# //p' "$0" >&2 && exit 2 ;;
    *) cases+=("$1") ;;
  esac
  shift
done
((${#cases[@]} > 0)) || cases=(image packages host private_shm bridge hardened killed cut compose site_test)

work=$(mktemp -d)
run=pocd-test-$$
network=$run
passed=0 failed=0 skipped=0

# Without a systemd, and where limits may not be raised.
skip() { # of a case: why
  echo "$*" >"$work/skip"
  exit 1
}
podman() { command podman --log-level fatal --runtime runc "$@"; }
limits=(--ulimit nofile=20000:20000 --ulimit nproc=1024:1024)

cleanup() {
  local ids
  ids=$(command podman ps -aq --filter "name=^$run" 2>/dev/null || true)
  [[ -z $ids ]] || podman rm -f -t 0 $ids >/dev/null 2>&1 || true
  podman volume rm -f "$run" >/dev/null 2>&1 || true
  podman network rm -f "$network" >/dev/null 2>&1 || true
  rm -rf "$work"
}
trap cleanup EXIT
skip_all() {
  echo "containers: skipped: $*"
  echo "0 passed, 0 failed, ${#cases[@]} skipped"
  exit 0
}

# --- what it needs -------------------------------------------------------------------------------
[[ $EUID -eq 0 ]] || skip_all "needs root"
for program in podman runc; do
  command -v "$program" >/dev/null || skip_all "$program is not installed (apt-get install podman runc debootstrap)"
done
base() { # debian:12 of Debian's packages
  podman image exists docker.io/library/debian:12 && podman image exists docker.io/library/debian:12-slim && return
  command -v debootstrap >/dev/null || skip_all "debootstrap is not installed"
  debootstrap --variant=minbase bookworm "$work/root" >"$work/debootstrap.log" 2>&1 ||
    skip_all "debootstrap: $(tail -n 1 "$work/debootstrap.log")"
  tar -C "$work/root" -c . | podman import - docker.io/library/debian:12 >/dev/null
  podman tag docker.io/library/debian:12 docker.io/library/debian:12-slim
  rm -rf "$work/root"
}
base
podman run --rm "${limits[@]}" --network none debian:12 true 2>"$work/err" ||
  skip_all "no container may be started here: $(tail -n 1 "$work/err")"
of_here=()
if [[ -n $here ]]; then
  [[ -x $source/install/bin/pocd_node ]] || skip_all "nothing is built in $source/install"
  image=debian:12
  of_here=(-v /usr:/usr:ro -v /etc/alternatives:/etc/alternatives:ro -v "$source/install/bin:/opt/pocd:ro"
    -e PATH=/opt/pocd:/usr/bin:/bin -e SKIP_DEFAULT_XML=1 -e POCD_HEALTH_SOCKET=/tmp/pocd_health --user 12346:12346)
elif [[ -z $image ]]; then
  image=pocd-test built=yes
  dockerfile=$source/launch_scripts/Dockerfile context=$source
  if [[ -n $packages ]]; then
    context=$work/context dockerfile=$work/Dockerfile
    mkdir -p "$context/pocd/output/packages"
    cp "$packages"/*.deb "$context/pocd/output/packages"
    sed -e '1,/^FROM debian:12-slim/{/^FROM debian:12-slim/!d}' -e 's#^COPY --from=build /#COPY #; s# /pocd/output# pocd/output#g' \
      "$source/launch_scripts/Dockerfile" >"$dockerfile"
  fi
  # What was compiled once is taken from the compiler's cache.
  cache=${CCACHE_DIR:-$HOME/.cache/ccache}
  mkdir -p "$cache" "$work/ccache"
  printf 'base_dir = /pocd\nhash_dir = false\n' >"$work/ccache/ccache.conf"
  echo "building $image"
  podman build --format docker --network host "${limits[@]}" --ulimit nproc=4096:4096 \
    --volume "$cache:/root/.cache/ccache" --volume "$work/ccache:/root/.config/ccache:ro" \
    -f "$dockerfile" -t "$image" "$context" >"$work/build.log" 2>&1 || {
    tail -n 30 "$work/build.log" >&2
    echo "0 passed, 1 failed, 0 skipped" && exit 1
  }
fi

# --- what cases share ----------------------------------------------------------------------------
domain=$((100 + RANDOM % 100))
site=$work/site
mkdir -p "$site"
cp "$source/test/integration/data/two_drives.yaml" "$source/config/simulated.yaml" "$source"/launch_scripts/*.xml "$site"
# Nobody else hears the host's network.
sed 's#</transport_descriptor>#<interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList></transport_descriptor>#' \
  "$site/udp_only.xml" >"$site/loopback_udp.xml"
chmod -R a+rX "$work"

box() { # NAME PODMAN_ARGUMENT... -- PROGRAM ARGUMENT...: starts a container
  local name=$1 options=()
  shift
  while [[ $1 != -- ]]; do options+=("$1") && shift; done
  podman run -d --name "$run-$name" "${limits[@]}" -e "ROS_DOMAIN_ID=$domain" -v "$site:/site:ro" \
    "${of_here[@]}" "${options[@]}" --entrypoint "$2" "$image" "${@:3}" >/dev/null
}
said() { podman logs "$run-$1" 2>&1; }
until_said() { # NAME TEXT [SECONDS]
  local end=$((SECONDS + ${3:-120}))
  until [[ $(said "$1") == *"$2"* ]]; do
    ((SECONDS < end)) || { echo "$1 did not say \"$2\": $(said "$1" | tail -n 3)" >&2 && return 1; }
    sleep 0.3
  done
}
until_said_after() { # NAME TEXT_BEFORE TEXT: after the last time of another text
  for ((i = 0; i < 400; ++i)); do
    [[ $(said "$1" | tac | sed "/$2/q") == *"$3"* ]] && return
    sleep 0.3
  done
  echo "$1 did not say \"$3\" again: $(said "$1" | tail -n 3)" >&2 && return 1
}
ended() { # NAME: waits for its end; succeeds with it
  local code
  code=$(podman wait "$run-$1")
  [[ $code == 0 ]] || { echo "$1 ended with $code: $(said "$1" | tail -n 3)" >&2 && return 1; }
}
stop() { podman kill -s INT "$run-$1" >/dev/null && ended "$1"; }
healthy() { # NAME: by the socket in its container
  podman exec "$run-$1" pocd_health --ready --timeout 60 >/dev/null
}
clear() {
  local ids
  ids=$(command podman ps -aq --filter "name=^$run")
  [[ -z $ids ]] || podman rm -f -t 0 $ids >/dev/null 2>&1
}
digest_of_text() { sed -n 's/.*digest \([0-9a-f]*\).*/\1/p' | tail -n 1; }
expected=""
offline() { # the digest of the same frames without a bus
  [[ -z $expected ]] || return 0
  box offline --network none -- pocd_map --dataset sim --input /site/two_drives.yaml --config /site/simulated.yaml \
    --output /tmp/map
  ended offline
  podman cp "$run-offline:/tmp/map/summary.yaml" "$work/summary.yaml"
  expected=$(sed -n 's/^map_digest: *"\{0,1\}\([0-9a-f]*\).*/\1/p' "$work/summary.yaml")
  [[ -n $expected ]] || { echo "no digest in summary.yaml" >&2 && return 1; }
}
node=(-- pocd_node --config /site/simulated.yaml --lossless)
play=(-- pocd_play --dataset sim --input /site/two_drives.yaml --no-color --fast --lossless)
follow=(-- pocd_mirror --until-end --timeout 300)
# Node, mirror and robots with these options of podman: the mirror ends with the map of the offline run.
whole_run() {
  offline
  box node "$@" "${node[@]}"
  box mirror "$@" "${follow[@]}"
  until_said mirror "in step with publisher"
  box play "$@" "${play[@]}"
  ended play
  stop node
  ended mirror
  local got
  got=$(said mirror | digest_of_text)
  [[ $got == "$expected" ]] || { echo "the map is $got, offline $expected" >&2 && return 1; }
}

# --- cases ---------------------------------------------------------------------------------------
case_image() {
  [[ -z $here ]] || skip "--here has no image"
  local missing depends user
  echo "image: $(podman image inspect "$image" --format '{{.Size}}' | awk '{printf "%.0f MB", $1 / 1e6}')" \
    "with the base's $(podman image inspect debian:12-slim --format '{{.Size}}' | awk '{printf "%.0f MB", $1 / 1e6}')"
  # Every library that a program is linked with is there, because the packages name it.
  missing=$(podman run --rm "${limits[@]}" --network none --entrypoint sh "$image" -c \
    'for program in /usr/bin/pocd_*; do ldd "$program" 2>/dev/null | grep "not found" && echo "$program"; done; true')
  [[ -z $missing ]] || { echo "$missing" >&2 && return 1; }
  depends=$(podman run --rm "${limits[@]}" --network none --entrypoint dpkg-query "$image" -W -f '${Depends}' pocd)
  [[ $depends == *libfastrtps*libstdc++6* ]] || { echo "the package names no libraries" >&2 && return 1; }
  user=$(podman run --rm "${limits[@]}" --network none --entrypoint id "$image" -u)
  [[ $user != 0 ]] || { echo "it runs as root" >&2 && return 1; }
}
case_packages() { # on a Debian 12 with nothing else, and with the small /dev/shm that a container has by default
  local folder=${packages:-$source/output/packages}
  ls "$folder"/pocd_*.deb >/dev/null 2>&1 || skip "no packages in $folder (launch_scripts/package.sh)"
  cat >"$site/packages.sh" <<'TEXT'
set -e
step() { echo "package: $*"; }
apt-get update >/dev/null
apt-get install -y --no-install-recommends /packages/pocd_*.deb /packages/pocd-tools_*.deb >/tmp/log 2>&1 || { cat /tmp/log; exit 1; }
for program in $(dpkg -L pocd pocd-tools | grep '^/usr/bin/pocd_'); do "$program" --help >/dev/null; done
step "$(dpkg -L pocd pocd-tools | grep -c '^/usr/bin/pocd_') programs run; /dev/shm has $(df -m --output=size /dev/shm | tail -n 1 | tr -d ' ') MB"
pocd_node --config /etc/pocd/classes.yaml --config /etc/pocd/site.yaml --dump >/dev/null
step "its configuration is one"
pocd_node --config /usr/share/pocd/config/simulated.yaml --lossless &
node=$!
pocd_health --ready --timeout 60
pocd_mirror --until-end --timeout 300 &
mirror=$!
pocd_play --dataset sim --input /usr/share/pocd/config/sim/demo.yaml --no-color --fast --lossless --max-frames 100
kill -INT "$node"
wait "$node"
wait "$mirror"
step "a map came over the bus"
apt-get purge -y pocd pocd-tools >/dev/null 2>&1
step "removed, $(ls /usr/bin/pocd_* /etc/pocd 2>/dev/null | wc -l) files left"
[ ! -e /usr/bin/pocd_node ] && [ ! -e /etc/pocd/site.yaml ]
TEXT
  chmod a+r "$site/packages.sh"
  podman run -d --name "$run-packages" "${limits[@]}" --network host -e "ROS_DOMAIN_ID=$domain" \
    -e FASTRTPS_DEFAULT_PROFILES_FILE=/site/loopback.xml -v "$site:/site:ro" -v "$folder:/packages:ro" \
    debian:12 bash /site/packages.sh >/dev/null
  ended packages
  said packages | grep '^package: '
}
case_host() { # as the compose file has it
  whole_run --network host --ipc host -e FASTRTPS_DEFAULT_PROFILES_FILE=/site/loopback.xml
}
case_private_shm() { # the host's network without its /dev/shm
  whole_run --network host -e FASTRTPS_DEFAULT_PROFILES_FILE=/site/loopback_udp.xml
  clear
  # Why the profile is needed: with shared memory they find each other, and no sample comes.
  box node --network host -e FASTRTPS_DEFAULT_PROFILES_FILE=/site/loopback.xml "${node[@]}"
  healthy node
  box asks --network host -e FASTRTPS_DEFAULT_PROFILES_FILE=/site/loopback.xml -- pocd_health --timeout 10
  [[ $(podman wait "$run-asks") != 0 ]] || echo "note: heard through a private /dev/shm; the profile is not needed here"
}
needs_network() {
  podman network exists "$network" || podman network create "$network" >/dev/null 2>"$work/err" &&
    podman run --rm "${limits[@]}" --network "$network" debian:12 true 2>"$work/err" && return
  skip "no bridge network can be made here: $(tail -n 1 "$work/err")"
}
case_bridge() { # a network of their own, with another vendor's DDS as one more subscriber
  needs_network
  local with_peer=""
  if [[ -x $peer ]]; then
    with_peer=yes
    mkdir -p "$work/peer"
    cp "$peer" "$work/peer/cyclone_peer"
    # Cyclone DDS and what it is linked with, which the image has not.
    ldd "$peer" | sed -n 's/.*=> \(\/[^ ]*\) .*/\1/p' | grep -v '/lib\(c\|m\|dl\|rt\|pthread\|gcc_s\|stdc++\)\.so' |
      xargs -r -I{} cp -L {} "$work/peer"
    # A camera that sends nothing: no frame follows the sizes, intrinsics and mount.
    python3 -c 'import struct, sys
sys.stdout.buffer.write(struct.pack("<2I11d", 32, 24, 30, 30, 16, 12, 0, 0, 0, .5, .5, .5, .5))' >"$work/peer/frames"
    chmod -R a+rX "$work/peer"
  else
    echo "note: $peer is not built: without Cyclone DDS"
  fi
  offline
  box node --network "$network" "${node[@]}" --set node.outputs.twins_hz=20 --set node.silent_wait_s=1
  box mirror --network "$network" "${follow[@]}"
  until_said mirror "in step with publisher"
  if [[ -n $with_peer ]]; then
    sed 's/name: robot1/name: robot9/' "$source/test/integration/data/two_drives.yaml" >"$site/nine.yaml"
    box peer --network "$network" -v "$work/peer:/peer:ro" -e LD_LIBRARY_PATH=/peer -- \
      /peer/cyclone_peer "$domain" /peer/frames /tmp/log
    until_said peer "sent 0 frames"
  fi
  local drives=two_drives
  [[ -z $with_peer ]] || drives=nine
  box play --network "$network" "${play[@]/two_drives/$drives}"
  ended play
  stop node
  ended mirror
  [[ $(said mirror | digest_of_text) == "$expected" ]] ||
    { echo "the map is $(said mirror | digest_of_text), offline $expected" >&2 && return 1; }
  [[ -z $with_peer ]] || until_said peer converged
}
case_hardened() { # no root, nothing writable but /tmp, no capabilities, limits of memory and CPU
  needs_network
  whole_run --network "$network" --user 12345:12345 --read-only --tmpfs /tmp --cap-drop all \
    --security-opt no-new-privileges --memory 512m --cpus 1 --pids-limit 256
  clear
  box node --network "$network" --user 12345:12345 --read-only --tmpfs /tmp --memory 512m "${node[@]}"
  healthy node
  [[ -n $here ]] || podman healthcheck run "$run-node" >/dev/null || { echo "the image's health check fails" >&2 && return 1; }
}
objects_of() { cut -d, -f1,3 "$work/$1/objects.csv"; }
copy() { # NAME OPTIONS...: what a subscriber that comes now has
  local name=$1
  shift
  box "$name" "$@" -- pocd_mirror --until-in-step --timeout 120 --output /tmp/copy
  ended "$name"
  podman cp "$run-$name:/tmp/copy" "$work/$name"
}
case_killed() { # a container that is killed and started again goes on with the volume of its memory
  needs_network
  podman volume create "$run" >/dev/null
  box node --network "$network" -v "$run:/var/lib/pocd:U" "${node[@]}" --set node.memory.folder=/var/lib/pocd
  healthy node
  box play --network "$network" "${play[@]}"
  ended play
  copy before --network "$network"
  local count
  count=$(objects_of before | wc -l)
  ((count > 2)) || { echo "only $count lines of objects" >&2 && return 1; }
  sleep 3 # the memory is written about once a second
  podman kill -s KILL "$run-node" >/dev/null
  podman wait "$run-node" >/dev/null
  podman start "$run-node" >/dev/null
  healthy node
  copy after --network "$network"
  diff <(objects_of before) <(objects_of after) >&2 || { echo "other objects than before" >&2 && return 1; }
  stop node
}
case_cut() { # a subscriber whose network is cut falls behind, says so, and catches up
  needs_network
  command -v nsenter >/dev/null || skip "nsenter is not installed"
  offline
  box node --network "$network" "${node[@]}"
  # Not until the end: for a copy that hears nothing, the publisher has gone.
  box mirror --network "$network" -- pocd_mirror --timeout 600
  until_said mirror "in step with publisher"
  set_network() {
    nsenter -t "$(podman inspect "$run-mirror" --format '{{.State.Pid}}')" -n ip link set eth0 "$1"
  }
  set_network down
  box play --network "$network" "${play[@]}"
  ended play
  until_said mirror "has gone without ending its run"
  set_network up
  until_said_after mirror "has gone without ending its run" "in step with publisher"
  stop node
  until_said mirror "which has ended its run"
  stop mirror
  [[ $(said mirror | digest_of_text) == "$expected" ]] || { echo "the map is another one" >&2 && return 1; }
}
case_compose() { # the compose file of a deployment: up, healthy, killed, up again, down
  [[ -z $here ]] || skip "--here has no image"
  command -v docker-compose >/dev/null || skip "docker-compose is not installed"
  local folder=$work/deployment name=${run}_pocd_1 service
  mkdir -p "$folder"
  # The image that is tested, and nothing of it leaves this host.
  sed -e '/^    build:/,/^      dockerfile:/d' -e "s#^    image: .*#    image: $image#" \
    -e 's#^      - memory:.*#&\n      - "'"$site"':/site:ro"#' \
    -e 's#^    environment:#&\n      FASTRTPS_DEFAULT_PROFILES_FILE: /site/loopback.xml#' \
    "$source/launch_scripts/compose.yaml" >"$folder/compose.yaml"
  # docker-compose asks podman in place of Docker.
  printf '[containers]\ndefault_ulimits = ["nofile=20000:20000", "nproc=1024:1024"]\n[engine]\nruntime = "runc"\n' \
    >"$work/containers.conf"
  CONTAINERS_CONF=$work/containers.conf command podman --log-level fatal system service --time 0 "unix://$work/socket" \
    >/dev/null 2>&1 &
  service=$!
  # shellcheck disable=SC2064  # now: it is local
  trap "kill $service 2>/dev/null || true" EXIT
  until [[ -S $work/socket ]]; do sleep 0.2; done
  compose() {
    (cd "$folder" && DOCKER_HOST=unix://$work/socket ROS_DOMAIN_ID=$domain timeout 120 docker-compose -p "$run" "$@") \
      >"$work/compose.log" 2>&1 || { tail -n 15 "$work/compose.log" >&2 && return 1; }
  }
  compose up -d
  podman exec "$name" pocd_health --ready --timeout 60 >/dev/null
  [[ $(podman inspect "$name" --format '{{.HostConfig.NetworkMode}}') == host ]]
  podman healthcheck run "$name" >/dev/null
  podman kill -s KILL "$name" >/dev/null
  compose up -d
  podman exec "$name" pocd_health --ready --timeout 60 >/dev/null
  compose down --volumes
}
case_site_test() { # the compose file for an integrator's own tests
  [[ -z $here ]] || skip "--here has no image"
  command -v podman-compose >/dev/null || skip "podman-compose is not installed"
  local folder=$work/compose
  mkdir -p "$folder"/{recordings,output}
  cp "$source"/launch_scripts/site_test/{compose,expected}.yaml "$folder"
  cp "$source/config/simulated.yaml" "$folder/site.yaml"
  sed -i "s#image: pocd\$#image: $image\n    ulimits: {nofile: 20000, nproc: 1024}#" "$folder/compose.yaml"
  # A recording, made of the simulator on a bus.
  box node --network none "${node[@]}"
  podman exec -d "$run-node" pocd_record --output /tmp/run.mcap --topic '/robot*' --topic '/tf*'
  podman exec "$run-node" pocd_play --dataset sim --input /site/two_drives.yaml --no-color --fast --lossless >/dev/null
  podman exec "$run-node" sh -c 'kill -INT $(pidof pocd_record); while pidof pocd_record >/dev/null; do sleep 0.2; done'
  podman cp "$run-node:/tmp/run.mcap" "$folder/recordings/run.mcap"
  clear
  chmod -R a+rX "$folder" && chmod a+rwX "$folder/output"
  up() {
    (cd "$folder" && ROS_DOMAIN_ID=$domain timeout 600 podman-compose -p "$run" --podman-args '--runtime runc' \
      up --exit-code-from check >"$work/compose.log" 2>&1)
  }
  local code=0
  up || code=$?
  [[ $code == 0 ]] || { tail -n 15 "$work/compose.log" >&2 && return 1; }
  [[ -s $folder/output/events.csv ]] || { echo "no events.csv" >&2 && return 1; }
  (cd "$folder" && podman-compose -p "$run" down >/dev/null 2>&1) || true
  echo "  - {kind: MOVED, x_m: 9, y_m: 9, from_x_m: 8, from_y_m: 8}" >"$work/more"
  sed -i "/^changes:/r $work/more" "$folder/expected.yaml"
  code=0
  up || code=$?
  (cd "$folder" && podman-compose -p "$run" down >/dev/null 2>&1) || true
  [[ $code != 0 ]] || { echo "what was not reported was no failure" >&2 && return 1; }
  grep -q "expected and not reported: MOVED" "$work/compose.log" ||
    { tail -n 15 "$work/compose.log" >&2 && return 1; }
}

for case in "${cases[@]}"; do
  declare -F "case_$case" >/dev/null || { echo "containers: no case $case" >&2 && exit 2; }
  begin=$SECONDS
  # In a shell of its own, which the first command that fails ends; not in a condition, where none would.
  set +e
  (set -e; "case_$case")
  status=$?
  set -e
  if [[ $status == 0 ]]; then
    passed=$((passed + 1)) && echo "ok      $case ($((SECONDS - begin)) s)"
  elif [[ -s $work/skip ]]; then
    skipped=$((skipped + 1)) && echo "skipped $case: $(cat "$work/skip")" && rm "$work/skip"
  else
    failed=$((failed + 1)) && echo "FAILED  $case"
  fi
  clear || true
done
[[ -n $keep || -z $built ]] || podman rmi pocd-test >/dev/null 2>&1 || true
echo "$passed passed, $failed failed, $skipped skipped"
((failed == 0))
