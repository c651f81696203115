/** Decodes a channel's messages by the schema that came with its advertisement, into plain objects. */

import { createFileRegistry, fromBinary, type DescMessage, type FileRegistry } from '@bufbuild/protobuf';
import { FileDescriptorSetSchema } from '@bufbuild/protobuf/wkt';
import type { Channel } from './messages.ts';

/** A decoded message: fields by their names in camelCase; 64-bit numbers are BigInt. */
export type Decoded = Record<string, any>;
export type Decoder = (payload: Uint8Array) => Decoded;

/** Schemas by their text, since many channels share one. */
const registries = new Map<string, FileRegistry>();

function registryOf(schema: string): FileRegistry {
  let registry = registries.get(schema);
  if (!registry) {
    const bytes = Uint8Array.from(atob(schema), (character) => character.charCodeAt(0));
    registry = createFileRegistry(fromBinary(FileDescriptorSetSchema, bytes));
    registries.set(schema, registry);
  }
  return registry;
}

/**
 * The decoder of a channel.
 * @throws Error if the schema cannot be read, lacks the type, or the encoding is unknown.
 */
export function decoderOf(channel: Channel): Decoder {
  if (channel.encoding !== 'protobuf')
    throw new Error(`${channel.topic}: the page cannot read the encoding "${channel.encoding}"`);
  const type: DescMessage | undefined = registryOf(channel.schema).getMessage(channel.schemaName);
  if (!type) throw new Error(`${channel.topic}: its schema lacks the type ${channel.schemaName}`);
  return (payload) => fromBinary(type, payload) as unknown as Decoded;
}

/** A 64-bit number as a number; NaN if there is none. */
export function toNumber(value: bigint | number | undefined): number {
  return value === undefined ? NaN : Number(value);
}

/** A google.protobuf.Timestamp or Duration, in seconds; NaN if there is none. */
export function toSeconds(value: any): number {
  return value ? toNumber(value.seconds) + value.nanos * 1e-9 : NaN;
}
