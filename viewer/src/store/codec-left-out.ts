// Stands for decoders that published stores do not need and that would make the page six times as large.
throw new Error("this page has no decoder for Blosc, LZ4 or Zstandard; impasto publishes with gzip");
