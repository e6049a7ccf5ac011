/** PNG files that say which colours they hold. */

const SIGNATURE = 8;

/** Returns what a canvas shows, just drawn, as a PNG file; `profile` is an ICC profile in base64. */
export async function saved(canvas: HTMLCanvasElement, profile?: string): Promise<Blob> {
  const png = await new Promise<Blob>((resolve, reject) =>
    canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("no picture"))), "image/png"),
  );
  if (!profile) return png;
  return withProfile(
    png,
    Uint8Array.from(atob(profile), (c) => c.charCodeAt(0)),
  );
}

/** Returns a PNG file with an ICC profile in it, in place of whatever the browser said about colours. */
export async function withProfile(png: Blob, profile: Uint8Array): Promise<Blob> {
  const bytes = new Uint8Array(await png.arrayBuffer());
  const packed = new Blob([profile as BlobPart]).stream().pipeThrough(new CompressionStream("deflate"));
  const compressed = new Uint8Array(await new Response(packed).arrayBuffer());
  const name = new TextEncoder().encode("sRGB");
  const data = new Uint8Array(name.length + 2 + compressed.length); // name, its end, method 0
  data.set(name);
  data.set(compressed, name.length + 2);
  const parts: Uint8Array[] = [bytes.subarray(0, SIGNATURE)];
  for (let at = SIGNATURE; at < bytes.length; ) {
    const length = new DataView(bytes.buffer, at).getUint32(0);
    const end = at + 12 + length;
    const kind = String.fromCharCode(...bytes.subarray(at + 4, at + 8));
    if (!["sRGB", "iCCP", "gAMA", "cHRM"].includes(kind)) parts.push(bytes.subarray(at, end));
    if (kind === "IHDR") parts.push(chunk("iCCP", data));
    at = end;
  }
  return new Blob(parts as BlobPart[], { type: "image/png" });
}

function chunk(kind: string, data: Uint8Array): Uint8Array {
  const result = new Uint8Array(12 + data.length);
  const view = new DataView(result.buffer);
  view.setUint32(0, data.length);
  result.set(new TextEncoder().encode(kind), 4);
  result.set(data, 8);
  view.setUint32(8 + data.length, crc32(result.subarray(4, 8 + data.length)));
  return result;
}

export function crc32(bytes: Uint8Array): number {
  let crc = ~0;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit++) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  }
  return ~crc >>> 0;
}
