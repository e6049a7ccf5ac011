//! Corrections of photographs as they are read: response, dark frame and flat field in one pass.

/// A value for each channel on a coarse grid over the whole photograph, its outer nodes on the outer pixels.
pub struct Grid<'a> {
    pub values: &'a [f32],
    pub rows: usize,
    pub columns: usize,
}

/// What is done to the codes of a photograph of `height` x `width` pixels.
pub struct Correction<'a> {
    pub height: usize,
    pub width: usize,
    pub channels: usize,
    /// Relative radiance of each code, one channel after the other; without it, full scale is 1.
    pub table: Option<&'a [f32]>,
    /// The code from which on a sample is clipped.
    pub clip: u32,
    /// Subtracted.
    pub dark: Option<Grid<'a>>,
    /// Multiplied with.
    pub gain: Option<Grid<'a>>,
}

/// Where a clipped sample and one without a code stand among the results.
pub trait Stored: Copy {
    const CLIPPED: Self;
    fn from_radiance(radiance: f32, per_step: f32) -> Self;
}

impl Stored for u16 {
    const CLIPPED: u16 = u16::MAX;

    fn from_radiance(radiance: f32, per_step: f32) -> u16 {
        (radiance * per_step + 0.5).clamp(0.0, (u16::MAX - 1) as f32) as u16
    }
}

impl Stored for f32 {
    const CLIPPED: f32 = f32::INFINITY;

    fn from_radiance(radiance: f32, _per_step: f32) -> f32 {
        radiance
    }
}

impl Grid<'_> {
    /// Fills `line` with the values of a row of pixels, interpolated linearly both ways.
    fn row(&self, row: usize, height: usize, width: usize, channels: usize, line: &mut [f32]) {
        let stride = self.columns * channels;
        let (upper, down) = place(row, height, self.rows);
        let node = |column: usize, channel: usize| {
            let at = upper * stride + column * channels + channel;
            let below = if upper + 1 < self.rows { at + stride } else { at };
            self.values[at] + down * (self.values[below] - self.values[at])
        };
        let nodes: Vec<f32> =
            (0..self.columns).flat_map(|column| (0..channels).map(move |channel| node(column, channel))).collect();
        for (column, pixel) in line.chunks_exact_mut(channels).enumerate() {
            let (left, across) = place(column, width, self.columns);
            let right = (left + 1).min(self.columns - 1);
            for channel in 0..channels {
                let from = nodes[left * channels + channel];
                pixel[channel] = from + across * (nodes[right * channels + channel] - from);
            }
        }
    }
}

/// The node before a pixel, and how far it lies on the way to the next.
fn place(pixel: usize, pixels: usize, nodes: usize) -> (usize, f32) {
    let at = if pixels > 1 { pixel as f32 * (nodes - 1) as f32 / (pixels - 1) as f32 } else { 0.0 };
    let before = (at as usize).min(nodes - 1);
    (before, at - before as f32)
}

/// Corrects a band of rows that begins at `row0`; returns how many samples are clipped.
pub fn correct<T: Stored>(codes: &[u16], row0: usize, per_step: f32, with: &Correction, out: &mut [T]) -> usize {
    let length = with.width * with.channels;
    let mut dark = vec![0.0; length];
    let mut gain = vec![1.0; length];
    let entries = with.table.map_or(0, |table| table.len() / with.channels);
    let clip = with.clip.min(1 << 16);
    let mut clipped = 0;
    for (number, (line, stored)) in codes.chunks_exact(length).zip(out.chunks_exact_mut(length)).enumerate() {
        if let Some(grid) = &with.dark {
            grid.row(row0 + number, with.height, with.width, with.channels, &mut dark);
        }
        if let Some(grid) = &with.gain {
            grid.row(row0 + number, with.height, with.width, with.channels, &mut gain);
        }
        let store = |code: u16, radiance: f32, at: usize| {
            if code as u32 >= clip { T::CLIPPED } else { T::from_radiance((radiance - dark[at]) * gain[at], per_step) }
        };
        match with.table {
            Some(table) => {
                for at in 0..length {
                    let code = line[at];
                    let entry = (code as usize).min(entries - 1);
                    stored[at] = store(code, table[at % with.channels * entries + entry], at);
                }
            }
            None => {
                for at in 0..length {
                    stored[at] = store(line[at], line[at] as f32 * (1.0 / 65535.0), at);
                }
            }
        }
        clipped += line.iter().filter(|&&code| code as u32 >= clip).count();
    }
    clipped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_of_gains_is_interpolated_between_its_nodes() {
        let values = [1.0, 2.0, 3.0, 4.0];
        let gain = Some(Grid { values: &values, rows: 2, columns: 2 });
        let with = Correction { height: 3, width: 3, channels: 1, table: None, clip: 60000, dark: None, gain };
        let codes = [6553u16, 6553, 6553, 6553, 65535, 6553, 6553, 6553, 6553];
        let mut out = [0.0f32; 9];
        assert_eq!(correct(&codes, 0, 1.0, &with, &mut out), 1);
        let unit = 6553.0 / 65535.0;
        for (at, gain) in [1.0, 1.5, 2.0, 2.0, f32::INFINITY, 3.0, 3.0, 3.5, 4.0].into_iter().enumerate() {
            assert!((out[at] - gain * unit).abs() < 1e-6 || out[at] == gain);
        }
        let mut band = [0u16; 3];
        correct(&codes[6..], 2, 65535.0, &with, &mut band);
        assert_eq!(band, [19659, 22936, 26212]);
    }

    #[test]
    fn the_dark_is_taken_off_after_the_table_and_nothing_goes_below_black() {
        let (values, table) = ([0.1], [0.0, 0.05, 0.3]);
        let dark = Some(Grid { values: &values, rows: 1, columns: 1 });
        let with =
            Correction { height: 1, width: 3, channels: 1, table: Some(&table), clip: 1 << 16, dark, gain: None };
        let mut out = [0u16; 3];
        assert_eq!(correct(&[0, 1, 2], 0, 1000.0, &with, &mut out), 0);
        assert_eq!(out, [0, 0, 200]);
    }
}
