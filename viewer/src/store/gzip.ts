/** Decodes gzip in memory of the right size, in place of zarrita's, which leaves megabytes per chunk to be collected. */

import { registry } from "zarrita";

/** No chunk of a published store is larger. */
const LARGEST = 64 << 20;
const SIZE_BYTES = 4;

class Gzip {
  readonly kind = "bytes_to_bytes";

  static fromConfig(): Gzip {
    return new Gzip();
  }

  encode(): never {
    throw new Error("this page only reads");
  }

  async decode(bytes: Uint8Array): Promise<Uint8Array> {
    // A gzip file ends with the size of what is in it. A file that was cut off ends with anything.
    const end = new DataView(bytes.buffer, bytes.byteOffset + bytes.byteLength - SIZE_BYTES);
    const size = bytes.byteLength > SIZE_BYTES ? end.getUint32(0, true) : 0;
    if (size === 0 || size > LARGEST) throw new Error("Failed to decode gzip");
    const result = new Uint8Array(size);
    let filled = 0;
    const gzip = new DecompressionStream("gzip");
    // Not through a Response, whose copy of the bytes stays until the garbage collector comes by.
    const writer = gzip.writable.getWriter();
    const written = Promise.all([writer.write(bytes as BufferSource), writer.close()]);
    written.catch(() => {}); // of a damaged file the reader hears too
    const reader = gzip.readable.getReader();
    for (let piece = await reader.read(); !piece.done; piece = await reader.read()) {
      if (filled + piece.value.byteLength > size) throw new Error("Failed to decode gzip");
      result.set(piece.value, filled);
      filled += piece.value.byteLength;
      release(piece.value);
    }
    await written;
    if (filled !== size) throw new Error("Failed to decode gzip");
    return result;
  }
}

/** Makes zarrita decode by this. */
export function useOwnGzip(): void {
  registry.set("gzip", async () => Gzip as never);
}

/** Gives memory back at once, rather than when the garbage collector comes by. */
export function release({ buffer }: ArrayBufferView): void {
  if (buffer instanceof ArrayBuffer && !buffer.detached) buffer.transfer?.(0);
}
