//! Compression by zstd, for the chunks of a store.

use zstd::bulk::{Compressor, Decompressor};
use zstd::zstd_safe::{CParameter, get_frame_content_size};

/// Compresses `data` into one frame, which notes its length and ends with a checksum.
pub fn compress(data: &[u8], level: i32) -> std::io::Result<Vec<u8>> {
    let mut compressor = Compressor::new(level)?;
    compressor.set_parameter(CParameter::ChecksumFlag(true))?;
    compressor.compress(data)
}

/// Decompresses a frame into `out`, which has its length.
pub fn decompress(frame: &[u8], out: &mut [u8]) -> std::io::Result<()> {
    match Decompressor::new()?.decompress_to_buffer(frame, out)? {
        length if length == out.len() => Ok(()),
        length => Err(std::io::Error::other(format!("a chunk of {length} bytes, expected {}", out.len()))),
    }
}

/// Length of what a frame holds, as it notes itself.
pub fn length(frame: &[u8]) -> std::io::Result<usize> {
    let length = get_frame_content_size(frame).ok().flatten();
    length.and_then(|length| length.try_into().ok()).ok_or_else(|| std::io::Error::other("not a chunk by zstd"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_compressed_comes_back() {
        let data: Vec<u8> = (0..100_000u32).map(|i| (i.wrapping_mul(i) >> 7) as u8).collect();
        for level in [-200, -1, 3] {
            let frame = compress(&data, level).unwrap();
            assert_eq!(length(&frame).unwrap(), data.len());
            let mut out = vec![0; data.len()];
            decompress(&frame, &mut out).unwrap();
            assert_eq!(out, data);
        }
    }

    #[test]
    fn damage_is_found() {
        let data: Vec<u8> = (0..5_000u32).map(|i| ((i * 7919) >> 5) as u8).collect();
        let frame = compress(&data, -200).unwrap();
        let mut out = vec![0; data.len()];
        for position in [9, frame.len() / 2, frame.len() - 1] {
            let mut damaged = frame.clone();
            damaged[position] ^= 4;
            assert!(decompress(&damaged, &mut out).is_err(), "byte {position}");
        }
        assert!(decompress(&frame[..100], &mut out).is_err());
        assert!(decompress(&frame, &mut out[..4999]).is_err());
        assert!(decompress(&frame, &mut vec![0; 5001]).is_err());
        assert!(length(b"no frame").is_err());
    }
}
