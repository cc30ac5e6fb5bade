// Reads everything that pocd_view offers with the Foxglove protocol's own client, and decodes it by its schema.
"use strict";
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const { WebSocket } = require("ws");
const { node, play, view, until, check, main } = require("./processes.js");

function decoderOf(channel) {
  if (channel.encoding === "json") {
    const schema = JSON.parse(channel.schema);
    check(channel.schemaEncoding === "jsonschema" && schema.type === "object", `${channel.topic} has a JSON schema`);
    return (data) => {
      const value = JSON.parse(new TextDecoder().decode(data));
      for (const [name, { type }] of Object.entries(schema.properties)) {
        const is = Array.isArray(value[name]) ? "array" : typeof value[name];
        if (name in value) check(is === type || (type === "integer" && Number.isInteger(value[name])), `${channel.topic}: ${name} is ${type}, not ${is}`);
      }
      return value;
    };
  }
  check(channel.encoding === "cdr" && channel.schemaEncoding === "ros2msg", `${channel.topic} is CDR with a ROS 2 schema`);
  const reader = new MessageReader(parse(channel.schema, { ros2: true }));
  return (data) => reader.readMessage(data);
}

/** The client knows the older name of the protocol only; what the server has chosen is in `chosen`. */
class Socket extends WebSocket {
  get chosen() { return super.protocol; }
  get protocol() { return FoxgloveClient.SUPPORTED_SUBPROTOCOL; }
}

async function connect(address, subprotocol) {
  const socket = new Socket(address.replace("http", "ws"), [subprotocol]);
  const client = new FoxgloveClient({ ws: socket });
  client.on("open", () => check(socket.chosen === subprotocol, `the server speaks ${subprotocol}`));
  const seen = { channels: [], messages: new Map(), statuses: [], parameters: null, info: null, time: null };
  const decoders = new Map();
  client.on("serverInfo", (info) => { seen.info = info; });
  client.on("status", (status) => seen.statuses.push(status));
  client.on("time", ({ timestamp }) => { seen.time = timestamp; });
  client.on("parameterValues", ({ parameters }) => { seen.parameters = parameters; });
  client.on("error", (error) => { throw error; });
  client.on("advertise", (channels) => {
    for (const channel of channels) {
      seen.channels.push(channel.topic);
      decoders.set(client.subscribe(channel.id), { topic: channel.topic, decode: decoderOf(channel) });
    }
  });
  client.on("message", ({ subscriptionId, timestamp, data }) => {
    const { topic, decode } = decoders.get(subscriptionId);
    const list = seen.messages.get(topic) ?? [];
    list.push({ timestamp, value: decode(data) });
    seen.messages.set(topic, list);
  });
  return { client, seen, unsubscribe: () => { for (const id of decoders.keys()) client.unsubscribe(id); } };
}

main(async () => {
  const server = await view("--port", "0");
  const component = node("--lossless", "--set", "node.outputs.markers_hz=5");
  const viewers = [await connect(server.address, "foxglove.websocket.v1"), await connect(server.address, "foxglove.sdk.v1")];
  for (const { seen } of viewers) await until(() => seen.channels.length > 8, "channels are advertised");
  const player = play("test/integration/data/two_drives.yaml", "--lossless", "--fast");
  check((await player.ended) === 0, "the player ended in order");
  const wanted = ["/pocd/objects", "/pocd/object_events", "/pocd/health", "/pocd/status", "/pocd/objects/markers", "/pocd/map", "/pocd/surface", "/diagnostics", "/rmf_obstacles", "/tf_static"];
  for (const { seen, client } of viewers) {
    check(seen.info.capabilities.includes("time") && seen.info.capabilities.includes("parameters"), "capabilities");
    for (const topic of wanted) await until(() => seen.messages.has(topic), `${topic} comes`);
    const events = seen.messages.get("/pocd/object_events");
    check(events.some(({ value }) => value.kind === "ADDED"), "an event in JSON");
    const event = events.at(-1);
    check(Math.abs(Number(event.timestamp) / 1e9 - event.value.stamp) < 1e-5, "an event has its own stamp");
    const markers = seen.messages.get("/pocd/objects/markers").at(-1).value.markers;
    check(markers.length > 0 && markers.every((m) => Number.isFinite(m.pose.position.x)), "markers are decoded");
    const grid = seen.messages.get("/pocd/map").at(-1).value;
    check(grid.data.length === grid.info.width * grid.info.height, "the grid is whole");
    const cloud = seen.messages.get("/pocd/surface").at(-1).value;
    check(cloud.data.length === cloud.row_step * cloud.height && cloud.width > 0, "the cloud is whole");
    await until(() => seen.time > 0n, "time comes");
    client.getParameters([], "all");
    await until(() => seen.parameters, "parameters come");
    const voxel = seen.parameters.find(({ name }) => name === "pocd.voxel");
    check(voxel && Math.abs(voxel.value - 0.05) < 1e-9, "the voxel size is a parameter");
    seen.parameters = null;
    client.setParameters([{ name: "pocd.voxel", value: 1 }], "set");
    await until(() => seen.parameters && seen.statuses.some(({ message }) => /cannot be set/.test(message)), "parameters are read-only");
    check(Math.abs(seen.parameters.find(({ name }) => name === "pocd.voxel").value - 0.05) < 1e-9, "and stay as they are");
  }
  viewers[0].unsubscribe();
  const late = await connect(server.address, "foxglove.sdk.v1");
  for (const topic of ["/pocd/objects", "/pocd/map", "/pocd/surface"]) await until(() => late.seen.messages.has(topic), `a late viewer gets ${topic}`);
  for (const { client } of [...viewers, late]) client.close();
  check((await component.end()) === 0, "the component ended in order");
  check((await server.end()) === 0, "pocd_view ended in order");
});
