// Reads everything that pocd_view offers with the Foxglove protocol's own client, and decodes it by its schema.
"use strict";
const path = require("path");
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const { WebSocket } = require("ws");
const { Program, node, play, view, until, check, main } = require("./processes.js");

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

/** The client knows the older name of the protocol only; what the server has chosen is in `chosen`. Nor does it know
    playbackControl: what is said about it goes to `played`. */
class Socket extends WebSocket {
  get chosen() { return super.protocol; }
  get protocol() { return FoxgloveClient.SUPPORTED_SUBPROTOCOL; }
  set onmessage(use) {
    super.onmessage = (event) => {
      if (event.data instanceof ArrayBuffer && new Uint8Array(event.data)[0] === 5) this.played(playbackState(Buffer.from(event.data)));
      else use(event);
    };
  }
  ask({ play, speed = 1, seek = null, id }) {
    const head = Buffer.alloc(19);
    head.writeUInt8(3, 0);
    head.writeUInt8(play ? 0 : 1, 1);
    head.writeFloatLE(speed, 2);
    head.writeUInt8(seek === null ? 0 : 1, 6);
    head.writeBigUInt64LE(seek ?? 0n, 7);
    head.writeUInt32LE(id.length, 15);
    this.send(Buffer.concat([head, Buffer.from(id)]));
  }
}

function playbackState(data) {
  check(data.length === 19 + data.readUInt32LE(15), "a state is as long as it says");
  return { status: ["playing", "paused", "buffering", "ended"][data.readUInt8(1)], time: data.readBigUInt64LE(2), speed: data.readFloatLE(10), sought: data.readUInt8(14) === 1, id: data.toString("utf8", 19) };
}

async function connect(address, subprotocol) {
  const socket = new Socket(address.replace("http", "ws"), [subprotocol]);
  const client = new FoxgloveClient({ ws: socket });
  client.on("open", () => check(socket.chosen === subprotocol, `the server speaks ${subprotocol}`));
  const seen = { channels: [], messages: new Map(), statuses: [], parameters: null, info: null, time: null, played: [] };
  socket.played = (state) => seen.played.push(state);
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
  return { client, seen, socket, unsubscribe: () => { for (const id of decoders.keys()) client.unsubscribe(id); } };
}

/** What was recorded, played by two viewers, each for itself. */
async function played(recording) {
  const server = await view(recording, "--port", "0");
  const [one, other] = [await connect(server.address, "foxglove.sdk.v1"), await connect(server.address, "foxglove.sdk.v1")];
  for (const { seen } of [one, other]) await until(() => seen.messages.get("/pocd/object_events")?.length > 3, "first, all of it");
  const { info } = one.seen;
  check(info.capabilities.includes("playbackControl"), "it can be played");
  const [start, end] = [info.dataStartTime, info.dataEndTime].map(({ sec, nsec }) => BigInt(sec) * 1000000000n + BigInt(nsec));
  check(end - start > 5000000000n && end - start < 120000000000n, `it lasts ${end - start} ns`);
  check(one.seen.channels.every((topic) => !["/pocd/map", "/tf"].includes(topic)), "no topics of a bus beside it");
  check(one.seen.played.at(-1).status === "ended" && one.seen.played.at(-1).time === end, "it stands at its end");
  const all = one.seen.messages.get("/pocd/object_events").map(({ value }) => value.kind);

  one.seen.messages.clear();
  one.socket.ask({ play: true, speed: 4, seek: start, id: "from the start" });
  await until(() => one.seen.played.at(-1).id === "from the start", "the request is answered");
  const begun = one.seen.played.at(-1);
  check(begun.status === "playing" && begun.sought && begun.time === start && begun.speed === 4, "it plays from the start");
  await until(() => one.seen.played.at(-1).status === "ended", "it ends");
  check(one.seen.played.at(-1).time === end, "at the end");
  await until(() => one.seen.time === end && one.seen.messages.get("/pocd/object_events").length >= all.length, "all events come again");
  const stamps = (topic) => one.seen.messages.get(topic).map(({ timestamp }) => timestamp);
  for (const topic of ["/pocd/object_events", "/pocd/objects"]) check(stamps(topic).every((stamp, i, list) => stamp >= start && stamp <= end && (i === 0 || stamp >= list[i - 1])), `${topic} comes in order`);
  const removed = one.seen.messages.get("/pocd/object_events").find(({ value }) => value.kind === "REMOVED");
  const gone = one.seen.messages.get("/pocd/objects").find(({ value }) => value.id === removed.value.id && value.condition === "gone");
  check(gone && gone.timestamp >= removed.timestamp, "what was removed goes then");

  const before = removed.timestamp - 2000000000n;
  one.seen.messages.clear();
  one.socket.ask({ play: false, seek: before, id: "before" });
  await until(() => one.seen.played.at(-1).id === "before" && one.seen.time === before, "it goes back");
  await until(() => one.seen.messages.get("/pocd/objects")?.some(({ value, timestamp }) => value.id === removed.value.id && value.condition === "present" && timestamp === before), "and the object is there again");
  check(other.seen.played.length === 1 && other.seen.time === end, "the other viewer stands where it stood");
  one.socket.send(Buffer.from([3, 0, 0, 0]));
  await until(() => one.socket.readyState === WebSocket.CLOSED, "a request that is cut off ends its client");
  other.socket.ask({ play: false, seek: start, id: "still here" });
  await until(() => other.seen.played.at(-1).id === "still here", "and no other one");
  other.client.close();
  check((await server.end()) === 0, "pocd_view ended in order");
}

main(async () => {
  const server = await view("--port", "0");
  const recording = path.resolve("run.mcap");
  const recorder = new Program("pocd_record", ["--output", recording, "--overwrite", "--topic", "pocd/*"]);
  await recorder.says(/topics|waits|records/i);
  const component = node("--lossless", "--set", "node.outputs.markers_hz=5");
  const viewers = [await connect(server.address, "foxglove.websocket.v1"), await connect(server.address, "foxglove.sdk.v1")];
  for (const { seen } of viewers) await until(() => seen.channels.length > 8, "channels are advertised");
  await recorder.says(/recording \S*pocd\/object_events/); // what was written before is gone for it
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
  check((await recorder.end()) === 0, "the recorder ended in order");
  await played(recording);
});
