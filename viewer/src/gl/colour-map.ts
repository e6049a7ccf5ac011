/** The colours of values: viridis, which grows evenly brighter and is told apart by colour-blind eyes too. */

// Every 32nd of matplotlib's 256 entries, and the last; between them it is nearly straight.
const ANCHORS = ["440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725"];

/** Returns 256 colours as RGBA bytes. */
export function colourMap(): Uint8Array {
  const colours = ANCHORS.map((hex) => [0, 2, 4].map((i) => Number.parseInt(hex.slice(i, i + 2), 16)));
  const bytes = new Uint8Array(4 * 256);
  for (let i = 0; i < 256; i++) {
    const place = (i / 255) * (colours.length - 1);
    const low = Math.min(Math.floor(place), colours.length - 2);
    for (let k = 0; k < 3; k++) {
      const [a, b] = [colours[low]![k]!, colours[low + 1]![k]!];
      bytes[4 * i + k] = Math.round(a + (b - a) * (place - low));
    }
    bytes[4 * i + 3] = 255;
  }
  return bytes;
}

/** The same as a CSS gradient from left to right. */
export function cssGradient(): string {
  return `linear-gradient(to right, ${ANCHORS.map((hex) => `#${hex}`).join(", ")})`;
}
