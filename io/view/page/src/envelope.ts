// SPDX-License-Identifier: Apache-2.0
// A message from the program: a JSON head and typed arrays, see io/view/envelope.h.
export type Numbers = Float32Array | Uint32Array | Int16Array | Uint8Array;

export interface Packet {
  head: any;
  arrays: Map<string, Numbers>;
}

const kinds = { f32: Float32Array, u32: Uint32Array, i16: Int16Array, u8: Uint8Array } as const;

export function unpack(buffer: ArrayBuffer): Packet {
  const size = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  const arrays = new Map<string, Numbers>();
  let at = 4 + size;
  for (const { name, type, count } of head.arrays) {
    const Kind = kinds[type as keyof typeof kinds];
    arrays.set(name, new Kind(buffer, at, count));
    at += Math.ceil((count * Kind.BYTES_PER_ELEMENT) / 4) * 4;
  }
  return { head, arrays };
}

export function floats(packet: Packet, name: string): Float32Array {
  const found = packet.arrays.get(name);
  return found instanceof Float32Array ? found : new Float32Array(0);
}
