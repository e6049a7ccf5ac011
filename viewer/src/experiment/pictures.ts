// Pictures, fetched ahead and decoded before they are shown, so that nobody ever sees a part of one.

export class Pictures {
  private readonly found = new Map<string, Promise<HTMLImageElement>>();

  constructor(private readonly fetched: (digest: string) => Promise<Blob>) {}

  /** Return the decoded picture. */
  get(digest: string): Promise<HTMLImageElement> {
    let picture = this.found.get(digest);
    if (picture === undefined) {
      picture = this.load(digest);
      this.found.set(digest, picture);
      picture.catch(() => this.found.delete(digest));
    }
    return picture;
  }

  /** Fetch pictures that will be needed, and forget the others but for those on display. */
  expect(digests: readonly string[], shown: readonly string[]): void {
    const wanted = new Set([...digests, ...shown]);
    for (const [digest, picture] of this.found) {
      if (wanted.has(digest)) continue;
      this.found.delete(digest);
      picture.then((image) => URL.revokeObjectURL(image.src)).catch(() => undefined);
    }
    for (const digest of digests) this.get(digest).catch(() => undefined);
  }

  private async load(digest: string): Promise<HTMLImageElement> {
    const image = new Image();
    image.src = URL.createObjectURL(await this.fetched(digest));
    image.draggable = false;
    await image.decode();
    return image;
  }
}
