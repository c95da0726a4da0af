//! Numbers with one derivative.

use std::iter::Sum;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// `v + d ε` with `ε² = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual {
    pub v: f64,
    pub d: f64,
}

impl From<f64> for Dual {
    fn from(v: f64) -> Self {
        Self { v, d: 0.0 }
    }
}

impl Dual {
    /// A function with value `v` and derivative `slope` at this number.
    fn chain(self, v: f64, slope: f64) -> Self {
        // A zero derivative stays zero where the slope is infinite.
        Self { v, d: if self.d == 0.0 { 0.0 } else { slope * self.d } }
    }
    pub fn exp(self) -> Self {
        self.chain(self.v.exp(), self.v.exp())
    }
    pub fn ln(self) -> Self {
        self.chain(self.v.ln(), 1.0 / self.v)
    }
    pub fn sqrt(self) -> Self {
        self.chain(self.v.sqrt(), 0.5 / self.v.sqrt())
    }
    pub fn sin(self) -> Self {
        self.chain(self.v.sin(), self.v.cos())
    }
    pub fn cos(self) -> Self {
        self.chain(self.v.cos(), -self.v.sin())
    }
    pub fn atan(self) -> Self {
        self.chain(self.v.atan(), 1.0 / (1.0 + self.v * self.v))
    }
    pub fn abs(self) -> Self {
        self.chain(self.v.abs(), self.v.signum())
    }
    pub fn sq(self) -> Self {
        self * self
    }
    pub fn powi(self, n: i32) -> Self {
        self.chain(self.v.powi(n), f64::from(n) * self.v.powi(n - 1))
    }
    /// `self^e` for a positive base.
    pub fn pow(self, e: Self) -> Self {
        let v = self.v.powf(e.v);
        let base = if self.d == 0.0 { 0.0 } else { e.v * self.v.powf(e.v - 1.0) * self.d };
        let exponent = if e.d == 0.0 { 0.0 } else { v * self.v.ln() * e.d };
        Self { v, d: base + exponent }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { v: self.v + o.v, d: self.d + o.d }
    }
}
impl Sub for Dual {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { v: self.v - o.v, d: self.d - o.d }
    }
}
impl Mul for Dual {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self { v: self.v * o.v, d: self.v * o.d + self.d * o.v }
    }
}
impl Div for Dual {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let v = self.v / o.v;
        Self { v, d: (self.d - v * o.d) / o.v }
    }
}
impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self { v: -self.v, d: -self.d }
    }
}
impl Sum for Dual {
    fn sum<I: Iterator<Item = Self>>(iter: I) -> Self {
        iter.fold(Self::from(0.0), |a, b| a + b)
    }
}

macro_rules! with_f64 {
    ($($op:ident $method:ident),*) => {$(
        impl $op<f64> for Dual {
            type Output = Dual;
            fn $method(self, o: f64) -> Dual {
                self.$method(Dual::from(o))
            }
        }
        impl $op<Dual> for f64 {
            type Output = Dual;
            fn $method(self, o: Dual) -> Dual {
                Dual::from(self).$method(o)
            }
        }
    )*};
}
with_f64!(Add add, Sub sub, Mul mul, Div div);
