// Reads a recording with Foxglove's libraries and prints what it found as
// JSON: node read_recording.mjs FILE.mcap
//
// The file is read twice, by its index and from front to back; both must
// decode the same messages.

import { open } from "node:fs/promises";

import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import zstd from "@foxglove/wasm-zstd";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";

const BLOCK_BYTES = 1 << 20;
const decompressHandlers = {
  zstd: (data, size) => zstd.decompress(data, Number(size)),
};

class Found {
  constructor() {
    this.schemas = new Map();
    this.channels = new Map();
    this.readers = new Map();
    this.topics = {};
  }

  addChannel(channel) {
    const schema = this.schemas.get(channel.schemaId);
    const text = new TextDecoder().decode(schema.data);
    this.channels.set(channel.id, channel);
    const definitions = parse(text, { ros2: true });
    this.readers.set(channel.id, new MessageReader(definitions));
    this.topics[channel.topic] = {
      type: schema.name,
      schemaEncoding: schema.encoding,
      messageEncoding: channel.messageEncoding,
      metadata: Object.fromEntries(channel.metadata),
      messages: [],
    };
  }

  addMessage(message) {
    const channel = this.channels.get(message.channelId);
    const content = this.readers.get(channel.id).readMessage(message.data);
    this.topics[channel.topic].messages.push({
      logTime: String(message.logTime),
      sequence: message.sequence,
      content: summary(content),
    });
  }
}

// Clouds shortened to what a table of numbers can be compared by.
function summary(content) {
  if (content.point_step === undefined) {
    return plain(content);
  }
  const { data, fields, point_step, ...rest } = content;
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const read = {
    2: (at) => view.getUint8(at),
    4: (at) => view.getUint16(at, true),
    6: (at) => view.getUint32(at, true),
    7: (at) => view.getFloat32(at, true),
  };
  const sums = {};
  for (const { name, offset, datatype } of fields) {
    sums[name] = 0;
    for (let at = offset; at < data.byteLength; at += point_step) {
      sums[name] += read[datatype](at);
    }
  }
  return { ...plain(rest), points: data.byteLength / point_step, sums };
}

// Typed arrays as JSON has them.
function plain(value) {
  return JSON.parse(
    JSON.stringify(value, (_, item) =>
      ArrayBuffer.isView(item) ? Array.from(item) : item,
    ),
  );
}

async function readIndexed(file) {
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, length) => {
      const buffer = new Uint8Array(Number(length));
      await file.read(buffer, 0, buffer.length, Number(offset));
      return buffer;
    },
  };
  const reader = await McapIndexedReader.Initialize({
    readable,
    decompressHandlers,
  });
  const found = new Found();
  found.schemas = reader.schemasById;
  for (const channel of reader.channelsById.values()) {
    found.addChannel(channel);
  }
  for await (const message of reader.readMessages()) {
    found.addMessage(message);
  }
  const attachments = {};
  for await (const attachment of reader.readAttachments()) {
    attachments[attachment.name] = {
      mediaType: attachment.mediaType,
      content: JSON.parse(new TextDecoder().decode(attachment.data)),
    };
  }
  const metadata = {};
  for await (const record of reader.readMetadata()) {
    metadata[record.name] = Object.fromEntries(record.metadata);
  }
  const { profile, library } = reader.header;
  return { profile, library, topics: found.topics, attachments, metadata };
}

async function readStream(file) {
  const reader = new McapStreamReader({ decompressHandlers });
  const found = new Found();
  const { size } = await file.stat();
  for (let offset = 0; offset < size; offset += BLOCK_BYTES) {
    const block = new Uint8Array(Math.min(BLOCK_BYTES, size - offset));
    await file.read(block, 0, block.length, offset);
    reader.append(block);
    for (let record; (record = reader.nextRecord()); ) {
      if (record.type === "Schema") {
        found.schemas.set(record.id, record);
      } else if (record.type === "Channel" && !found.channels.has(record.id)) {
        found.addChannel(record);
      } else if (record.type === "Message") {
        found.addMessage(record);
      }
    }
  }
  if (!reader.done()) {
    throw new Error("the file goes on");
  }
  return found.topics;
}

await zstd.isLoaded;
const file = await open(process.argv[2]);
const found = await readIndexed(file);
const streamed = await readStream(file);
await file.close();
if (JSON.stringify(streamed) !== JSON.stringify(found.topics)) {
  throw new Error("index and stream give different messages");
}
console.log(JSON.stringify(found));
