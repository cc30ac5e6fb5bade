#!/usr/bin/env bash
# The component loads what the method needs: no readers of picture, map and table files, no simulator.
# usage: check_libraries.sh INSTALL_PREFIX
set -euo pipefail
prefix=$1
unwanted='gdal|poppler|hdf5|libpcl|vtk|opencv_(imgcodecs|highgui|viz)|embree|sqlite|netcdf'
failed=0
checked=0
for program in pocd_node pocd_health pocd_doctor; do
  [[ -x $prefix/bin/$program ]] || continue  # built without the bus
  checked=$((checked + 1))
  libraries=$(ldd "$prefix/bin/$program")
  if grep -E "$unwanted" <<<"$libraries" >&2; then
    echo "$program loads them, of $(wc -l <<<"$libraries") libraries" >&2
    failed=1
  fi
done
((checked > 0)) || echo "no program of the bus is installed: nothing to check"
exit $failed
