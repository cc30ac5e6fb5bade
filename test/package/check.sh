#!/usr/bin/env bash
# Makes the packages, unpacks them into a folder, and looks whether everything is there and runs.
# usage: check.sh SOURCE PREFIX WORK
set -euo pipefail
source=$1 prefix=$2 work=$3
rm -rf "$work" && mkdir -p "$work"
fail() {
  echo "package: $*" >&2
  exit 1
}

"$source/launch_scripts/package.sh" --prefix "$prefix" --output "$work/packages"
root=$work/root
for package in "$work"/packages/*.deb; do
  dpkg-deb -x "$package" "$root"
  dpkg-deb -e "$package" "$work/control_$(dpkg-deb -f "$package" Package)"
done

# Every program is in one package, with a man page, and runs.
for program in "$prefix"/bin/pocd_*; do
  name=$(basename "$program")
  case "$name" in pocd_benchmark | pocd_bus_costs | pocd_changed_scene | pocd_scale | pocd_transport_costs) continue ;; esac
  count=$(for package in "$work"/packages/*.deb; do dpkg-deb -c "$package"; done | grep -c "/usr/bin/$name$" || true)
  [[ $count -eq 1 ]] || fail "$name is in $count packages"
  "$root/usr/bin/$name" --help >/dev/null || fail "$name does not run"
  gzip -dc "$root/usr/share/man/man1/$name.1.gz" | grep -q '^\.SH OPTIONS\|^\.SS "Options' ||
    fail "the man page of $name has no options"
done
for package in pocd pocd-tools; do
  depends=$(sed -n 's/^Depends: //p' "$work/control_$package/control")
  [[ "$depends" == *libc6* && "$depends" == *libstdc++6* ]] || fail "$package depends on: $depends"
done
grep -q '^Depends:.*libfastrtps' "$work/control_pocd/control" || fail "pocd does not depend on Fast DDS"
[[ -z "$(ldd "$root/usr/bin/pocd_node" | grep 'not found')" ]] || fail "pocd_node lacks libraries"

# The shipped configuration is one, and an edit of it survives an upgrade.
"$root/usr/bin/pocd_node" --config "$root/etc/pocd/classes.yaml" --config "$root/etc/pocd/site.yaml" --dump \
  >"$work/effective.yaml" || fail "/etc/pocd is no configuration"
while read -r file; do
  [[ -f "$root$file" ]] || fail "conffile $file is not in the package"
done <"$work/control_pocd/conffiles"
for file in "$root"/etc/pocd/* "$root"/etc/sysctl.d/*; do
  grep -qxF "${file#"$root"}" "$work/control_pocd/conffiles" || fail "${file#"$root"} is no conffile"
done
for script in postinst prerm postrm; do
  sh -n "$work/control_pocd/$script" || fail "$script"
done

# The unit as systemd reads it; the program it starts is looked for where it was unpacked.
if command -v systemd-analyze >/dev/null; then
  sed "s#/usr/bin/#$root/usr/bin/#" "$root/usr/lib/systemd/system/pocd.service" >"$work/pocd.service"
  said=$(systemd-analyze verify --man=no "$work/pocd.service" 2>&1 | grep 'pocd\.service' || true)
  [[ -z "$said" ]] || fail "systemd: $said"
fi

# The live page comes with its files.
for file in index.html main.js three/build/three.module.js three/examples/jsm/controls/OrbitControls.js; do
  cmp -s "$prefix/share/pocd_view/page/$file" "$root/usr/share/pocd_view/page/$file" || fail "pocd-tools lacks $file of the page"
done

# What is developed against it: a program of another project finds the CMake packages where they are.
[[ -f $root/usr/lib/cmake/pocd_dds/pocd_ddsConfig.cmake && -f $root/usr/include/pocd_dds/map_mirror.hpp ]] ||
  fail "libpocd-dev lacks files"
grep -rIl "$(realpath "$prefix")" "$root/usr/lib/cmake" "$root/usr/include" && fail "files name the build folder" || true
echo "package: $(du -sh "$work"/packages/*.deb | tr '\n' ' ')"
