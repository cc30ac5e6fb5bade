#!/usr/bin/env bash
# pocd_core knows no middleware: neither its sources, nor its installed headers, nor its libraries.
# usage: check_core.sh SOURCE_FOLDER INSTALL_PREFIX
set -euo pipefail
source_folder=$1
prefix=$2
pattern='fastdds|fastrtps|fastcdr|dds/|eprosima|rclcpp|PubSubTypes|pocd_msgs|pocd_dds'
failed=0

complain() {
  echo "$1" >&2
  failed=1
}

checked=0
while IFS= read -r -d '' file; do
  checked=$((checked + 1))
  if grep -nE "^[[:space:]]*#[[:space:]]*include.*($pattern)" "$file" >&2; then
    complain "$file includes middleware"
  fi
done < <(find "$source_folder/pocd_core" "$prefix/include/pocd" -type f \
  \( -name '*.hpp' -o -name '*.cpp' -o -name '*.h' \) -print0)
((checked > 20)) || complain "only $checked files found: wrong folders?"

for library in "$prefix"/lib/libpocd_{core,memory,io,config,sim,datasets,eval,network}.a; do
  [[ -f $library ]] || { complain "$library is not installed" && continue; }
  if nm --demangle "$library" 2>/dev/null | grep -E 'eprosima|fastdds|fastcdr' >&2; then
    complain "$library uses middleware symbols"
  fi
done

for program in pocd_map pocd_parameters; do
  [[ -x $prefix/bin/$program ]] || continue
  if ldd "$prefix/bin/$program" | grep -E 'fastrtps|fastcdr|ddsc' >&2; then
    complain "$program is linked with middleware"
  fi
done
# What is on the bus at a site reads no image files, data sets or scenes, and runs no network.
offline='opencv_dnn|opencv_imgcodecs|libgdal|libpoppler|libhdf5|libpcl|libvtk|libembree'
for program in pocd_node pocd_mirror pocd_health pocd_view pocd_record; do
  [[ -x $prefix/bin/$program ]] || continue
  if ldd "$prefix/bin/$program" | grep -E "$offline" >&2; then
    complain "$program loads what only offline programs need"
  fi
  echo "$program: $(ldd "$prefix/bin/$program" | grep -c '=>') shared libraries"
done
exit $failed
