// Opens a recording with @mcap/core, by its index and as a stream with all CRCs checked, and decodes
// every message of every channel by its schema. Usage: node check.js FILE
"use strict";
const fs = require("fs");
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader: RosReader } = require("@foxglove/rosmsg2-serialization");
const { parseIDL } = require("@foxglove/omgidl-parser");
const { MessageReader: IdlReader } = require("@foxglove/omgidl-serialization");
const fzstd = require("fzstd");

const decompressHandlers = { zstd: (data, size) => fzstd.decompress(data, new Uint8Array(Number(size))) };

function decoder(schema) {
  const text = new TextDecoder().decode(schema.data);
  if (schema.encoding === "ros2msg") return new RosReader(parse(text, { ros2: true }));
  if (schema.encoding === "omgidl") return new IdlReader(schema.name, parseIDL(text));
  throw new Error(`schema ${schema.name} has the encoding '${schema.encoding}'`);
}

async function main(file) {
  const bytes = fs.readFileSync(file);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + size))),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  if (reader.header.profile !== "ros2") throw new Error(`profile is '${reader.header.profile}'`);
  const decoders = new Map();
  const counts = new Map();
  let last = 0n;
  let indexed = 0;
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    if (channel.messageEncoding !== "cdr") throw new Error(`${channel.topic}: ${channel.messageEncoding}`);
    if (!decoders.has(channel.schemaId)) {
      decoders.set(channel.schemaId, decoder(reader.schemasById.get(channel.schemaId)));
    }
    const value = decoders.get(channel.schemaId).readMessage(message.data);
    const stamp = value.header?.stamp ?? value.stamp;
    if (stamp && !(stamp.sec >= 0 && (stamp.nanosec ?? stamp.nsec) < 1e9)) {
      throw new Error(`${channel.topic}: stamp ${JSON.stringify(stamp)}`);
    }
    if (value.encoding && value.data.length !== value.step * value.height) {
      throw new Error(`${channel.topic}: image of ${value.data.length} bytes`);
    }
    if (message.logTime < last) throw new Error("messages are out of order");
    last = message.logTime;
    counts.set(channel.topic, (counts.get(channel.topic) ?? 0) + 1);
    ++indexed;
  }
  if (BigInt(indexed) !== reader.statistics.messageCount) throw new Error("statistics disagree");

  const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  stream.append(bytes);
  let streamed = 0;
  for (let record; (record = stream.nextRecord()); ) streamed += record.type === "Message";
  if (!stream.done() || streamed !== indexed) throw new Error(`stream gives ${streamed} messages`);

  for (const [topic, count] of [...counts].sort()) console.log(`${topic}: ${count}`);
  console.log(`decoded ${indexed} messages of ${counts.size} channels`);
}

main(process.argv[2]).catch((error) => {
  console.error(`check.js: ${error.stack}`);
  process.exit(1);
});
