//! Fresnel's reflectance of a smooth dielectric.

use crate::number::Number;

/// The reflectance for unpolarised light, exactly ([CookTorrance1982], Eq. 15), with a single division.
#[inline(always)]
pub fn fresnel<N: Number>(cosine: N, index: f64) -> N {
    let one = N::splat(1.0);
    let g = cosine.mul_add(cosine, N::splat(index * index - 1.0)).sqrt();
    let (sum, difference) = (g + cosine, g - cosine);
    let (above, below) = (cosine.mul_add(sum, -one), cosine.mul_add(difference, one));
    let squares = above.mul_add(above, below * below);
    (difference.squared() * squares / (sum * below).squared()).scale(N::Real::splat(0.5))
}
