//! The numerical core of impasto: numbers in, numbers out.
