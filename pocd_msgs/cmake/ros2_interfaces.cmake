# Makes the ROS 2 interface package pocd_interfaces of pocd_msgs.idl: what the topics of `node.outputs.twins_hz`
# carry, without keys, which ROS 2 does not know.
#
#   cmake -DFROM=pocd_msgs/idl/pocd_msgs.idl -DVERSION=0.1.0 -DTO=NEW_FOLDER -P ros2_interfaces.cmake
#
# TO/pocd_interfaces.idl has the types as IDL; TO/pocd_interfaces is the package (.msg files, package.xml,
# CMakeLists.txt) that a ROS 2 workspace builds with colcon as it is.
cmake_minimum_required(VERSION 3.22)
if(NOT EXISTS "${FROM}" OR "${TO}" STREQUAL "" OR "${VERSION}" STREQUAL "")
  message(FATAL_ERROR "usage: cmake -DFROM=pocd_msgs.idl -DVERSION=0.1.0 -DTO=NEW_FOLDER -P ros2_interfaces.cmake")
endif()

set(roots ObjectList ObjectEvent NodeHealth)
set(types_octet uint8)
set(types_boolean bool)
set(types_int8 int8)
set(types_float float32)
set(types_double float64)
set(types_string string)
set(types_short int16)
set(types_unsigned_short uint16)
set(types_long int32)
set(types_unsigned_long uint32)
set(types_long_long int64)
set(types_unsigned_long_long uint64)

# CMake takes ; for the end of a list's entry, and [ ] for a bracket around several.
file(READ ${FROM} text)
string(REPLACE ";" "%s" text "${text}")
string(REPLACE "[" "%o" text "${text}")
string(REPLACE "]" "%c" text "${text}")
string(REPLACE "\n" ";" lines "${text}")

# Sets `result` to the type's name in a .msg file; to the structs that are needed adds the type if it is ours.
function(ros_type type result)
  string(REPLACE " " "_" basic "${type}")
  if(DEFINED types_${basic})
    set(${result} ${types_${basic}} PARENT_SCOPE)
  elseif(type MATCHES "^pocd_msgs::msg::([A-Za-z0-9]+)$")
    set(${result} ${CMAKE_MATCH_1} PARENT_SCOPE)
    set(needs ${needs} ${CMAKE_MATCH_1} PARENT_SCOPE)
  elseif(type MATCHES "^([a-z_]+)::msg::([A-Za-z0-9]+)$")
    set(${result} ${CMAKE_MATCH_1}/${CMAKE_MATCH_2} PARENT_SCOPE)
  else()
    message(FATAL_ERROR "${FROM}: ${struct}: no such type in a .msg file: ${type}")
  endif()
endfunction()

# Every struct: its comment and fields as IDL (idl_NAME) and as .msg (msg_NAME), and the structs it needs.
set(comment)
set(structs)
set(struct)
foreach(line IN LISTS lines)
  string(STRIP "${line}" words)
  if(words MATCHES "^// ?(.*)$")
    string(APPEND comment "# ${CMAKE_MATCH_1}\n")
  elseif(words MATCHES "^@final struct ([A-Za-z0-9]+) {$")
    set(struct ${CMAKE_MATCH_1})
    set(msg_${struct} "${comment}")
    string(REPLACE "# " "// " idl_${struct} "${comment}")
    string(APPEND idl_${struct} "@final struct ${struct} {\n")
    set(comment)
    set(needs)
  elseif(struct AND words STREQUAL "}%s")
    string(APPEND idl_${struct} "}%s\n\n")
    set(needs_${struct} ${needs})
    list(APPEND structs ${struct})
    set(struct)
  elseif(struct AND words MATCHES "^(@key )?(.+) ([a-z0-9_]+)(%o[0-9]+%c)?%s$")
    set(type "${CMAKE_MATCH_2}")
    set(name "${CMAKE_MATCH_3}")
    set(size "${CMAKE_MATCH_4}")
    set(suffix "${size}")
    set(element "${type}")
    if(type MATCHES "^sequence<(.+)>$")
      set(element "${CMAKE_MATCH_1}")
      set(suffix "%o%c")
    endif()
    ros_type("${element}" ros)
    string(APPEND msg_${struct} "${comment}${ros}${suffix} ${name}\n")
    string(REPLACE "# " "  // " idl_comment "${comment}")
    string(APPEND idl_${struct} "${idl_comment}  ${type} ${name}${size}%s\n")
    set(comment)
  elseif(struct AND words)
    message(FATAL_ERROR "${FROM}: ${struct}: cannot read '${words}'")
  else()
    set(comment)
  endif()
endforeach()

# Those that the topics carry, in the order of the IDL, which is that of definition before use.
set(wanted ${roots})
set(open ${roots})
while(open)
  list(POP_FRONT open name)
  foreach(more ${needs_${name}})
    if(NOT more IN_LIST wanted)
      list(APPEND wanted ${more})
      list(APPEND open ${more})
    endif()
  endforeach()
endwhile()

function(write_back name text)
  string(REPLACE "%s" ";" text "${text}")
  string(REPLACE "%o" "[" text "${text}")
  string(REPLACE "%c" "]" text "${text}")
  string(REPLACE "pocd_msgs::" "pocd_interfaces::" text "${text}")
  file(WRITE ${TO}/${name} "${text}")
endfunction()

file(REMOVE_RECURSE ${TO}/pocd_interfaces)
set(idl "// Made of pocd_msgs.idl by ros2_interfaces.cmake: for ROS 2, without keys.
#ifndef POCD_IDL_POCD_INTERFACES
#define POCD_IDL_POCD_INTERFACES

#include \"builtin_interfaces.idl\"
#include \"geometry_msgs.idl\"
#include \"std_msgs.idl\"

module pocd_interfaces {
module msg {
")
set(files)
foreach(name ${structs})
  if(name IN_LIST wanted)
    string(APPEND idl "${idl_${name}}")
    string(APPEND files "  msg/${name}.msg\n")
    write_back(pocd_interfaces/msg/${name}.msg "${msg_${name}}")
  endif()
endforeach()
string(REGEX REPLACE "\n\n$" "\n" idl "${idl}")
write_back(pocd_interfaces.idl "${idl}}%s\n}%s\n\n#endif\n")

write_back(pocd_interfaces/package.xml "<?xml version=\"1.0\"?>
<package format=\"3\">
  <name>pocd_interfaces</name>
  <version>${VERSION}</version>
  <description>Messages of POCD's topics for ROS 2: objects, events, health</description>
  <maintainer email=\"pocd@localhost\">POCD on Fast DDS</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>builtin_interfaces</depend>
  <depend>geometry_msgs</depend>
  <depend>std_msgs</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
")
write_back(pocd_interfaces/CMakeLists.txt "cmake_minimum_required(VERSION 3.8)
project(pocd_interfaces)
find_package(ament_cmake REQUIRED)
find_package(builtin_interfaces REQUIRED)
find_package(geometry_msgs REQUIRED)
find_package(std_msgs REQUIRED)
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces(\${PROJECT_NAME}
${files}  DEPENDENCIES builtin_interfaces geometry_msgs std_msgs)
ament_export_dependencies(rosidl_default_runtime)
ament_package()
")
