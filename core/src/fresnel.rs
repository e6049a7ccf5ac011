//! Fresnel's reflectance of a smooth dielectric.

use crate::number::{Number, Real};

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

/// The reflectance and its slope by the cosine, with a single division.
///
/// With c the cosine and g = √(c² + n² − 1), the amplitudes r = (g − c) / (g + c) and b = (c (g + c) − 1) / (c (g − c) + 1)
/// have the slopes −2 r / g and (c² (n² + 1) + n² − 1) / (g (c (g − c) + 1)²); F = r² (1 + b²) / 2.
#[inline(always)]
pub fn fresnel_slope<R: Real>(cosine: R, index: f64) -> (R, R) {
    let one = R::splat(1.0);
    let rest = R::splat(index * index - 1.0);
    let square = cosine * cosine;
    let g = (square + rest).sqrt();
    let (sum, difference) = (g + cosine, g - cosine);
    let (above, below) = (cosine.mul_add(sum, -one), cosine.mul_add(difference, one));
    let product = sum * below;
    let inverse = one / (g * product);
    let (per_g, per_product) = (inverse * product, inverse * g);
    let squares = (difference * per_product).squared();
    let twice = squares * above.mul_add(above, below * below);
    let growth = square.mul_add(R::splat(index * index + 1.0), rest) * above * squares * (sum * per_product);
    (R::splat(0.5) * twice, (per_g + per_g) * (growth - twice))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Dual;

    #[test]
    fn the_slope_is_that_of_the_reflectance() {
        for (cosine, index) in [(0.02, 1.5), (0.3, 1.2), (0.7, 1.5), (1.0, 2.4)] {
            let want = fresnel(Dual::<f64, 1>::parameter(cosine, 0, 1.0), index);
            let (value, slope) = fresnel_slope(cosine, index);
            assert!((value - want.value).abs() < 1e-12);
            assert!((slope - want.derivative[0]).abs() < 1e-12 * (1.0 + slope.abs()), "{slope}, want {want:?}");
        }
    }
}
