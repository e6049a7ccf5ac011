//! The row of numbers that a fit writes for each pixel.

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

/// Where each quantity stands in a row, as (first column, number of columns).
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    pub channels: usize,
    pub lobes: usize,
    pub shape: usize,
    /// Number of ambient magnitudes: the channels, or 0.
    pub ambient: usize,
}

impl Layout {
    /// Name and width of each quantity, in the order of the row.
    pub fn columns(&self) -> [(&'static str, usize); 12] {
        [
            ("normal", 3),
            ("diffuse", self.channels),
            ("specular", self.lobes),
            ("shape", self.shape),
            ("ambient", self.ambient),
            ("chi2_reduced", 1),
            ("residual_rms", 1),
            ("normal_sd", 1),
            ("diffuse_sd", self.channels),
            ("specular_sd", self.lobes),
            ("shape_sd", self.shape),
            ("ambient_sd", self.ambient),
        ]
    }

    pub fn width(&self) -> usize {
        self.columns().iter().map(|(_, width)| width).sum()
    }
}

/// Appends quantities to a pixel's row in the order of [`Layout::columns`].
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
