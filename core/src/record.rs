//! The row of numbers that a fit writes for each pixel.

use crate::lanes::LANES;

/// Why a pixel's parameters are what they are. The order is the code in the status map.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(u8)]
pub enum Status {
    Converged = 0,
    StepLimit = 1,
    AtBound = 2,
    TooFewLights = 3,
    AllClipped = 4,
    NotIdentified = 5,
}

const MAX_COLUMNS: usize = 14;
const UNUSED: (&str, usize) = ("", 0);

/// What a fit writes for a pixel: the name and the number of columns of each quantity, in order.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    pub columns: [(&'static str, usize); MAX_COLUMNS],
}

impl Layout {
    /// A joint fit's row; `ambient` is the number of ambient magnitudes, `colours` that of a highlight's colour, `lights` that
    /// of the lights of which it is told whether the pixel lies in their shadow.
    pub const fn joint(
        channels: usize,
        lobes: usize,
        shape: usize,
        ambient: usize,
        colours: usize,
        lights: usize,
    ) -> Self {
        Layout {
            columns: [
                ("normal", 3),
                ("diffuse", channels),
                ("specular", lobes),
                ("shape", shape),
                ("ambient", ambient),
                ("specular_rgb", colours),
                ("chi2_reduced", 1),
                ("residual_rms", 1),
                ("normal_sd", 1),
                ("diffuse_sd", channels),
                ("specular_sd", lobes),
                ("shape_sd", shape),
                ("ambient_sd", ambient),
                ("shadowed", lights),
            ],
        }
    }

    /// The row of the paper's procedure, whose unweighted residuals give no uncertainties.
    pub const fn paper(channels: usize) -> Self {
        Layout {
            columns: [
                ("normal", 3),
                ("diffuse", channels),
                ("specular", 1),
                ("shape", 1),
                ("ambient", channels),
                ("residual_rms", 1),
                ("view_tilt", 1),
                UNUSED,
                UNUSED,
                UNUSED,
                UNUSED,
                UNUSED,
                UNUSED,
                UNUSED,
            ],
        }
    }

    pub const fn width(&self) -> usize {
        let mut width = 0;
        let mut i = 0;
        while i < self.columns.len() {
            width += self.columns[i].1;
            i += 1;
        }
        width
    }
}

/// A fit of some pixels, sixteen at a time.
pub trait FitBlock {
    fn layout(&self) -> Layout;
    /// Fits the pixels from `first` on, of which the tile has as many as `status` says, and writes them.
    fn fit_block(&mut self, first: usize, rows: &mut [f32], status: &mut [u8]);
}

/// The groups of a block: the first pixel of each, and where its rows and status go.
#[inline(always)]
pub fn groups<'a>(
    first: usize,
    width: usize,
    rows: &'a mut [f32],
    status: &'a mut [u8],
) -> impl Iterator<Item = (usize, &'a mut [f32], &'a mut [u8])> {
    let groups = rows.chunks_mut(LANES * width).zip(status.chunks_mut(LANES));
    groups.enumerate().map(move |(group, (rows, status))| (first + group * LANES, rows, status))
}

/// Appends quantities to a pixel's row in the order of its layout.
pub struct Row<'a> {
    rest: &'a mut [f32],
}

impl<'a> Row<'a> {
    pub fn new(row: &'a mut [f32]) -> Self {
        Row { rest: row }
    }

    #[inline(always)]
    pub fn push(&mut self, value: f32) {
        let (first, rest) = std::mem::take(&mut self.rest).split_first_mut().expect("a row as wide as its layout");
        *first = value;
        self.rest = rest;
    }

    #[inline(always)]
    pub fn extend(&mut self, values: impl IntoIterator<Item = f32>) {
        for value in values {
            self.push(value);
        }
    }
}
