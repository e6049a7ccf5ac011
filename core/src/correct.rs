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
        // By way of a signed integer, which processors convert floats to directly.
        (radiance * per_step + 0.5).clamp(0.0, (u16::MAX - 1) as f32) as i32 as u16
    }
}

impl Stored for f32 {
    const CLIPPED: f32 = f32::INFINITY;

    fn from_radiance(radiance: f32, _per_step: f32) -> f32 {
        radiance
    }
}

/// A grid spread over rows of pixels, one after the other.
struct Lines<'a, 'b> {
    grid: &'a Grid<'b>,
    /// Of each column of pixels: the node before it, and how far it lies on the way to the next.
    places: Vec<(usize, f32)>,
    /// The two rows of nodes about the latest row of pixels, spread over its pixels.
    upper: Vec<f32>,
    lower: Vec<f32>,
    nodes: Option<usize>,
}

impl<'a, 'b> Lines<'a, 'b> {
    fn new(grid: &'a Grid<'b>, with: &Correction) -> Self {
        let places = (0..with.width).map(|column| place(column, with.width, grid.columns)).collect();
        let length = with.width * with.channels;
        Lines { grid, places, upper: vec![0.0; length], lower: vec![0.0; length], nodes: None }
    }

    /// Fills `line` with the values of a row of pixels, interpolated linearly both ways.
    fn row(&mut self, row: usize, with: &Correction, line: &mut [f32]) {
        let (nodes, down) = place(row, with.height, self.grid.rows);
        if self.nodes != Some(nodes) {
            self.grid.spread(nodes, &self.places, with.channels, &mut self.upper);
            self.grid.spread((nodes + 1).min(self.grid.rows - 1), &self.places, with.channels, &mut self.lower);
            self.nodes = Some(nodes);
        }
        for ((value, upper), lower) in line.iter_mut().zip(&self.upper).zip(&self.lower) {
            *value = upper + down * (lower - upper);
        }
    }
}

impl Grid<'_> {
    /// Spreads a row of nodes over a row of pixels.
    fn spread(&self, row: usize, places: &[(usize, f32)], channels: usize, line: &mut [f32]) {
        let nodes = &self.values[row * self.columns * channels..][..self.columns * channels];
        for (pixel, &(left, across)) in line.chunks_exact_mut(channels).zip(places) {
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
    let (mut dark, mut gain, mut radiance) = (vec![0.0; length], vec![1.0; length], vec![0.0; length]);
    let mut dark_lines = with.dark.as_ref().map(|grid| Lines::new(grid, with));
    let mut gain_lines = with.gain.as_ref().map(|grid| Lines::new(grid, with));
    let entries = with.table.map_or(0, |table| table.len() / with.channels);
    let clip = with.clip.min(1 << 16);
    let mut clipped = 0;
    // Each loop does one thing, so that the compiler can make vectors of it.
    for (number, (line, stored)) in codes.chunks_exact(length).zip(out.chunks_exact_mut(length)).enumerate() {
        if let Some(lines) = &mut dark_lines {
            lines.row(row0 + number, with, &mut dark);
        }
        if let Some(lines) = &mut gain_lines {
            lines.row(row0 + number, with, &mut gain);
        }
        match with.table {
            Some(table) => {
                for (codes, pixel) in line.chunks_exact(with.channels).zip(radiance.chunks_exact_mut(with.channels)) {
                    for channel in 0..with.channels {
                        pixel[channel] = table[channel * entries + (codes[channel] as usize).min(entries - 1)];
                    }
                }
            }
            None => {
                for (value, &code) in radiance.iter_mut().zip(line) {
                    *value = code as f32 * (1.0 / 65535.0);
                }
            }
        }
        for at in 0..length {
            let value = T::from_radiance((radiance[at] - dark[at]) * gain[at], per_step);
            stored[at] = if line[at] as u32 >= clip { T::CLIPPED } else { value };
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
