# Writes the IDL files once more with the type names that ROS 2 has on the wire, for the generators of other
# vendors, which know no `-typeros2`: module `dds_` inside of `msg`, and an underscore behind every type.
#
#   cmake -DFROM=/usr/local/share/pocd_msgs/idl -DTO=idl -P ros2_type_names.cmake
cmake_minimum_required(VERSION 3.22)
if(NOT IS_DIRECTORY "${FROM}" OR "${TO}" STREQUAL "")
  message(FATAL_ERROR "usage: cmake -DFROM=FOLDER_OF_IDL -DTO=NEW_FOLDER -P ros2_type_names.cmake")
endif()
file(GLOB files ${FROM}/*.idl)
if(NOT files)
  message(FATAL_ERROR "${FROM}: no IDL files")
endif()
foreach(file ${files})
  file(READ ${file} text)
  # CMake takes ; for the end of a list's entry.
  string(REPLACE ";" "\t" text "${text}")
  string(REGEX REPLACE "::msg::([A-Za-z0-9]+)" "::msg::dds_::\\1_" text "${text}")
  string(REGEX REPLACE "struct ([A-Za-z0-9]+) {" "struct \\1_ {" text "${text}")
  string(REPLACE "module msg {" "module msg {\nmodule dds_ {" text "${text}")
  string(REPLACE "}\t\n}\t\n}\t\n\n#endif" "}\t\n}\t\n}\t\n}\t\n\n#endif" text "${text}")
  string(REPLACE "\t" ";" text "${text}")
  get_filename_component(name ${file} NAME)
  file(WRITE ${TO}/${name} "${text}")
endforeach()
