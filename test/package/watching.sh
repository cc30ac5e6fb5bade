#!/usr/bin/env bash
# What is shipped for those who watch, by Prometheus's own tools: its configuration and rules are read, each alert
# is raised by what it waits for and by nothing else, and each query of the dashboard is answered by a Prometheus
# that asks a node with a robot. Both listen on this machine only.
# usage: watching.sh SOURCE PREFIX. Exit code 77: Debian's package prometheus is not installed.
set -euo pipefail
source=$1 prefix=$2
for program in promtool prometheus; do
  command -v "$program" >/dev/null || { echo "watching: skipped: no $program (Debian's package prometheus)" && exit 77; }
done
work=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; wait; rm -rf "$work"' EXIT
fail() {
  echo "watching: $*" >&2
  exit 1
}
cp "$source"/launch_scripts/watching/* "$source/test/package/alerts_test.yaml" "$work"
cd "$work"
promtool check rules alerts.yaml || fail "alerts.yaml"
promtool test rules alerts_test.yaml || fail "alerts_test.yaml"
[[ $(grep -c '^      - alert:' alerts.yaml) == $(sed -n 's/^ *alertname: \([A-Za-z]*\)$/\1/p; s/.*alertname: \([A-Za-z]*\)}$/\1/p' \
  alerts_test.yaml | sort -u | wc -l) ]] || fail "an alert has no test"

free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }
node=$(free_port) server=$(free_port)
export ROS_DOMAIN_ID=${ROS_DOMAIN_ID:-$((100 + RANDOM % 100))} FASTRTPS_DEFAULT_PROFILES_FILE=$source/launch_scripts/loopback.xml
sed -i "s#127.0.0.1:9464#127.0.0.1:$node#; s#/usr/share/pocd/watching/##; s#scrape_interval: .*#scrape_interval: 1s#" prometheus.yaml
promtool check config prometheus.yaml >said 2>&1 || fail "prometheus.yaml: $(cat said)"
"$prefix/bin/pocd_node" --config "$source/config/simulated.yaml" --metrics "$node" --set node.memory.folder=memory >node 2>&1 &
"$prefix/bin/pocd_play" --dataset sim --input "$source/test/integration/data/two_drives.yaml" --no-color --repeat 1000 >play 2>&1 &
prometheus --config.file=prometheus.yaml --storage.tsdb.path=data --web.listen-address="127.0.0.1:$server" >server 2>&1 &

ask() { promtool query instant "http://127.0.0.1:$server" "$1" 2>&1; }
until_answered() { # QUERY: what is asked comes to be known
  local end=$((SECONDS + 120))
  until [[ -n $(ask "$1" | grep -v '^error\|^query error\|rror executing') ]]; do
    ((SECONDS < end)) || fail "no answer to $1: $(ask "$1"); $(tail -n 2 node play server)"
    sleep 0.5
  done
}
until_answered 'up{job="pocd"} == 1'
python3 -c 'import json
for panel in json.load(open("grafana.json"))["panels"]:
    for target in panel.get("targets", []):
        print(target["expr"].replace("$node", ".*"))' >queries
(($(wc -l <queries) > 10)) || fail "no queries in grafana.json"
while read -r query; do
  # Nothing goes wrong here.
  [[ $query == *pocd_problems_total* ]] && { [[ $(ask "$query") != *rror* ]] || fail "$(ask "$query")"; continue; }
  until_answered "$query"
done <queries
echo "watching: $(grep -c '^      - alert:' alerts.yaml) alerts, $(wc -l <queries) queries"
