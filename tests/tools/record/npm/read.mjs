// Reads a recording by its index. Prints one JSON line for each message, and one for the file.
import { open } from "node:fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { parseIDL } from "@foxglove/omgidl-parser";
import { MessageReader } from "@foxglove/omgidl-serialization";
import { decompress } from "fzstd";

const file = await open(process.argv[2], "r");
const size = (await file.stat()).size;
const readable = {
  size: async () => BigInt(size),
  read: async (offset, length) => {
    const bytes = new Uint8Array(Number(length));
    await file.read(bytes, 0, Number(length), Number(offset));
    return bytes;
  },
};
const plain = (key, value) =>
  typeof value === "bigint" ? value.toString() : ArrayBuffer.isView(value) ? Array.from(value, String) : value;
const print = (value) => console.log(JSON.stringify(value, plain));

const reader = await McapIndexedReader.Initialize({
  readable,
  decompressHandlers: { zstd: (bytes, unpacked) => decompress(bytes, new Uint8Array(Number(unpacked))) },
});
const decoders = new Map();
function decoderOf(channel) {
  if (!decoders.has(channel.id)) {
    const schema = reader.schemasById.get(channel.schemaId);
    const definitions = parseIDL(new TextDecoder().decode(schema.data));
    decoders.set(channel.id, new MessageReader(schema.name, definitions));
  }
  return decoders.get(channel.id);
}
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const line = { topic: channel.topic, log: message.logTime };
  try {
    line.value = decoderOf(channel).readMessage(message.data);
  } catch (error) {
    line.error = error.message;
  }
  print(line);
}
print({
  messages: reader.statistics.messageCount,
  chunks: reader.chunkIndexes.length,
  schemas: [...reader.schemasById.values()].map((schema) => schema.encoding),
});
