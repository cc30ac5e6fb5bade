// Serialises a message of each type by the public definitions of ROS 2 humble, iron and jazzy, and compares it byte by
// byte with what write_messages.cpp wrote. Usage: node check_cdr.js FOLDER
"use strict";
const fs = require("fs");
const path = require("path");
const { parse } = require("@foxglove/rosmsg");
const { ros2humble, ros2iron, ros2jazzy } = require("@foxglove/rosmsg-msgs-common");
const { MessageWriter } = require("@foxglove/rosmsg2-serialization");

const releases = { humble: ros2humble, iron: ros2iron, jazzy: ros2jazzy };

// Definitions that the package does not have, as their projects publish them (map_msgs of navigation_msgs,
// rmf_obstacle_msgs of rmf_internal_msgs, rmw_dds_common).
const others = {
  "map_msgs/OccupancyGridUpdate":
    "std_msgs/Header header\nint32 x\nint32 y\nuint32 width\nuint32 height\nint8[] data",
  "rmf_obstacle_msgs/BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size",
  "rmf_obstacle_msgs/Obstacle":
    "std_msgs/Header header\nint32 id\nstring source\nstring level_name\nstring classification\n" +
    "rmf_obstacle_msgs/BoundingBox3D bbox\nfloat64 data_resolution\nint8[] data\n" +
    "builtin_interfaces/Duration lifetime\nint32 action",
  "rmf_obstacle_msgs/Obstacles": "std_msgs/Header header\nrmf_obstacle_msgs/Obstacle[] obstacles",
  "rmw_dds_common/Gid": "uint8[16] data",
  "rmw_dds_common/NodeEntitiesInfo":
    "string node_namespace\nstring node_name\nrmw_dds_common/Gid[] reader_gid_seq\n" +
    "rmw_dds_common/Gid[] writer_gid_seq",
  "rmw_dds_common/ParticipantEntitiesInfo":
    "rmw_dds_common/Gid gid\nrmw_dds_common/NodeEntitiesInfo[] node_entities_info_seq",
};
const othersInHumble = {
  "rmf_obstacle_msgs/Obstacles": "rmf_obstacle_msgs/Obstacle[] obstacles",
  "rmw_dds_common/Gid": "uint8[24] data",
};

let release = "";
function definition(type) {
  if (releases[release][type]) return { ...releases[release][type], name: type };
  const text = (release === "humble" && othersInHumble[type]) || others[type];
  if (!text) throw new Error(`no public definition of ${type}`);
  return { ...parse(text, { ros2: true, skipTypeFixup: true })[0], name: type };
}

/** The type and all that it is made of, itself first. */
function closure(type, known = new Map()) {
  if (known.has(type)) return known;
  const found = definition(type);
  known.set(type, found);
  for (const field of found.definitions) if (field.isComplex) closure(field.type, known);
  return known;
}

let differences = 0;
let number = 0;
function value(field, types) {
  if (field.isArray) {
    const length = field.arrayLength ?? 2;
    return Array.from({ length }, () => value({ ...field, isArray: false }, types));
  }
  if (field.isComplex) return message(types.get(field.type), types);
  if (field.type === "time" || field.type === "duration") return { sec: ++number, nsec: ++number };
  ++number;
  if (field.type === "string") return `s${number}`;
  if (field.type === "bool") return number % 2 === 1;
  if (field.type.startsWith("float")) return number + 0.5;
  return /^u?int8$/.test(field.type) ? number % 100 : number;
}
function message(type, types) {
  const result = {};
  for (const field of type.definitions) if (!field.isConstant) result[field.name] = value(field, types);
  return result;
}

/** The order in which write_messages.cpp numbered the fields is the public one. */
function checkFields(file, types) {
  for (const line of fs.readFileSync(file, "utf8").trim().split("\n")) {
    const [, scoped, list] = /^(.*?): (.*)$/.exec(line);
    const type = types.get(scoped.replace("::msg::", "/").replace(/Humble$/, ""));
    if (!type) continue; // time and duration, which are primitive there
    const written = list.replace(/m\.|\(\)|\s/g, "");
    const expected = type.definitions.filter((f) => !f.isConstant).map((f) => f.name).join(",");
    if (written === expected) continue;
    ++differences;
    console.error(`${scoped}: fields ${written}, expected ${expected} (${release})`);
  }
}

const folder = process.argv[2];
const files = fs.readdirSync(folder).filter((name) => name.endsWith(".cdr"));
let comparisons = 0;
function compare(name, type) {
  const types = closure(type);
  checkFields(path.join(folder, name.replace(".cdr", ".fields")), types);
  number = 0;
  const expected = Buffer.from(new MessageWriter([...types.values()]).writeMessage(message(types.get(type), types)));
  const written = fs.readFileSync(path.join(folder, name));
  ++comparisons;
  if (written.equals(expected)) return;
  ++differences;
  let at = 0;
  while (at < written.length && written[at] === expected[at]) ++at;
  console.error(
    `${type} of ${release}: ${written.length} bytes written, ${expected.length} expected, differ from byte ${at}`);
}
// Those with two forms are written as "type@humble" and "type@iron", the latter for all later ones.
for (const name of files) {
  const [type, form] = name.replace(".cdr", "").replace(".", "/").split("@");
  for (release of Object.keys(releases)) {
    if (!form || (form === "humble") === (release === "humble")) compare(name, type);
  }
}
console.log(`compared ${files.length} types, ${comparisons} comparisons with ${Object.keys(releases).join(", ")}`);
process.exit(files.length === 15 && comparisons === 39 && differences === 0 ? 0 : 1);
