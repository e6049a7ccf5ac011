//! The numerical core of impasto: numbers in, numbers out. No files, and no Python types but in `python`.

// Without Python nothing calls the core but its tests.
#![cfg_attr(not(feature = "python"), allow(dead_code))]
// Lanes and channels are walked by index side by side; zipped iterators hide that and vectorise worse.
#![allow(clippy::needless_range_loop)]

mod arrow;
mod codec;
mod correct;
mod dispatch;
mod dual;
mod fresnel;
mod geometry;
mod joint;
mod lanes;
mod minimise;
pub mod models;
mod number;
mod observations;
mod paper;
mod paper_shape;
#[cfg(feature = "python")]
mod python;
mod record;
mod render;
mod residual;
mod robust;
mod separable;
mod shadows;
mod slopes;
mod start;
mod threads;
