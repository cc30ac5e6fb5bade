// Serialises a message of each type by the public definitions of ROS 2 humble and compares it byte by byte with what
// write_messages.cpp wrote. Usage: node check_cdr.js FOLDER
"use strict";
const fs = require("fs");
const path = require("path");
const { parse } = require("@foxglove/rosmsg");
const { ros2humble } = require("@foxglove/rosmsg-msgs-common");
const { MessageWriter } = require("@foxglove/rosmsg2-serialization");

// Definitions that the package does not have, as their projects publish them (map_msgs of navigation_msgs,
// rmf_obstacle_msgs of rmf_internal_msgs).
const others = {
  "map_msgs/OccupancyGridUpdate":
    "std_msgs/Header header\nint32 x\nint32 y\nuint32 width\nuint32 height\nint8[] data",
  "rmf_obstacle_msgs/BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size",
  "rmf_obstacle_msgs/Obstacle":
    "std_msgs/Header header\nint32 id\nstring source\nstring level_name\nstring classification\n" +
    "rmf_obstacle_msgs/BoundingBox3D bbox\nfloat64 data_resolution\nint8[] data\n" +
    "builtin_interfaces/Duration lifetime\nint32 action",
  "rmf_obstacle_msgs/Obstacles": "std_msgs/Header header\nrmf_obstacle_msgs/Obstacle[] obstacles",
};

function definition(type) {
  if (ros2humble[type]) return { ...ros2humble[type], name: type };
  if (!others[type]) throw new Error(`no public definition of ${type}`);
  return { ...parse(others[type], { ros2: true, skipTypeFixup: true })[0], name: type };
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
    const type = types.get(scoped.replace("::msg::", "/"));
    if (!type) continue; // time and duration, which are primitive there
    const written = list.replace(/m\.|\(\)|\s/g, "");
    const expected = type.definitions.filter((f) => !f.isConstant).map((f) => f.name).join(",");
    if (written === expected) continue;
    ++differences;
    console.error(`${scoped}: fields ${written}, expected ${expected}`);
  }
}

const folder = process.argv[2];
const files = fs.readdirSync(folder).filter((name) => name.endsWith(".cdr"));
for (const name of files) {
  const type = name.replace(".cdr", "").replace(".", "/");
  const types = closure(type);
  checkFields(path.join(folder, name.replace(".cdr", ".fields")), types);
  number = 0;
  const expected = Buffer.from(new MessageWriter([...types.values()]).writeMessage(message(types.get(type), types)));
  const written = fs.readFileSync(path.join(folder, name));
  if (written.equals(expected)) continue;
  ++differences;
  let at = 0;
  while (at < written.length && written[at] === expected[at]) ++at;
  console.error(`${type}: ${written.length} bytes written, ${expected.length} expected, differ from byte ${at}`);
}
console.log(`compared ${files.length} types`);
process.exit(files.length === 11 && differences === 0 ? 0 : 1);
