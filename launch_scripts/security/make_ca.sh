#!/usr/bin/env bash
# Makes an authority for tests, and with it identities and permissions: for each ENCLAVE a folder that the
# programs take with --security. Made again, it keeps the authority and adds enclaves.
# For production keep ca.key.pem on a machine that is not on the network, or use your own authority.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

usage() {
  cat <<'TEXT'
usage: make_ca.sh OUTPUT ENCLAVE... [--days N]
  ENCLAVE  ROLE or ROLE:NAME; roles are the files of roles/: component, operator, robot, subscriber.
           A robot's NAME is the one in its topics (rt/NAME/...).
  --days   how long certificates and permissions hold; default 365
example: make_ca.sh output/security component subscriber operator robot:robot1 robot:robot2
TEXT
}

days=365
words=()
while [[ $# -gt 0 ]]; do
  case "$1" in
    --days) shift && days=${1:?--days needs a number} ;;
    --help | -h) usage && exit 0 ;;
    -*) usage >&2 && exit 2 ;;
    *) words+=("$1") ;;
  esac
  shift
done
((${#words[@]} >= 2)) || { usage >&2 && exit 2; }
[[ "$days" =~ ^[1-9][0-9]*$ ]] || { echo "make_ca.sh: --days $days, expected a number" >&2 && exit 2; }
output=${words[0]}
command -v openssl >/dev/null || { echo "make_ca.sh: openssl is not installed" >&2 && exit 1; }

umask 077
mkdir -p "$output"
key() { openssl ecparam -name prime256v1 -genkey -noout -out "$1"; }
if [[ ! -f $output/ca.key.pem ]]; then
  key "$output/ca.key.pem"
  openssl req -x509 -new -sha256 -key "$output/ca.key.pem" -subj "/CN=POCD test authority" -days "$days" \
    -out "$output/ca.cert.pem"
fi
sign() {
  openssl smime -sign -text -in "$1" -out "$2" -signer "$output/ca.cert.pem" -inkey "$output/ca.key.pem" 2>/dev/null
}
sign "$here/governance.xml" "$output/governance.p7s"
from=$(date -u -d yesterday +%Y-%m-%dT00:00:00) to=$(date -u -d "+$days days" +%Y-%m-%dT00:00:00)

for enclave in "${words[@]:1}"; do
  role=${enclave%%:*} name=${enclave#*:}
  if [[ ! -f $here/roles/$role.xml ]]; then
    echo "make_ca.sh: no role \"$role\"; there are: $(cd "$here/roles" && echo *.xml | sed 's/\.xml//g')" >&2
    exit 2
  fi
  if [[ ! "$name" =~ ^[A-Za-z0-9_]+$ ]]; then
    echo "make_ca.sh: name \"$name\", expected letters, digits and _" >&2
    exit 2
  fi
  [[ "$role" == "robot" && "$enclave" != *:* ]] && { echo "make_ca.sh: robot needs a name: robot:NAME" >&2 && exit 2; }
  folder=$output/$name
  mkdir -p "$folder"
  key "$folder/key.pem"
  openssl req -new -sha256 -key "$folder/key.pem" -subj "/CN=$name" -out "$folder/request.pem"
  openssl x509 -req -sha256 -in "$folder/request.pem" -CA "$output/ca.cert.pem" -CAkey "$output/ca.key.pem" \
    -CAcreateserial -days "$days" -out "$folder/cert.pem" 2>/dev/null
  rm "$folder/request.pem"
  cat >"$folder/permissions.xml" <<XML
<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
     xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
  <permissions>
    <grant name="$name">
      <subject_name>CN=$name</subject_name>
      <validity><not_before>$from</not_before><not_after>$to</not_after></validity>
      <allow_rule>
        <domains><id_range><min>0</min><max>232</max></id_range></domains>
$(sed -e '/^<!--/d' -e "s/NAME/$name/g" "$here/roles/$role.xml")
      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
XML
  sign "$folder/permissions.xml" "$folder/permissions.p7s"
  cp "$output/ca.cert.pem" "$folder/identity_ca.cert.pem"
  cp "$output/ca.cert.pem" "$folder/permissions_ca.cert.pem"
  cp "$output/governance.p7s" "$folder/governance.p7s"
  echo "$folder: $role"
done
