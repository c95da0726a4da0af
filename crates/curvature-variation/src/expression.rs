//! Energies written as text, such as `0.92*bending + 0.08*mehlum_tarrou`.

use crate::functional::{Energy, Functional};
use std::str::FromStr;

/// Why a text is not an energy; positions count characters from 0.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("energy expression, position {position}: {message}, in '{text}'")]
pub struct ExpressionError {
    /// The whole text.
    pub text: String,
    /// Where it goes wrong.
    pub position: usize,
    /// What was found and what could stand there.
    pub message: String,
}

impl FromStr for Energy {
    type Err = ExpressionError;

    /// Reads a sum of terms `number * name`, `name * number`, `number name` or `name`, with signs;
    /// the names are those of [`Functional::name`], and `mehlum_tarrou(w1, w3)` takes weights.
    fn from_str(text: &str) -> Result<Self, ExpressionError> {
        Parser { text, chars: text.chars().collect(), at: 0 }.energy()
    }
}

struct Parser<'a> {
    text: &'a str,
    chars: Vec<char>,
    at: usize,
}

impl Parser<'_> {
    fn energy(mut self) -> Result<Energy, ExpressionError> {
        let mut terms = Vec::new();
        loop {
            self.skip_spaces();
            let mut sign = 1.0;
            if !terms.is_empty() {
                match self.peek() {
                    None => return Ok(Energy { terms }),
                    Some('+' | '-') => {}
                    Some(c) => return self.fail(format!("found '{c}'; join terms by + or -")),
                }
            }
            while let Some(c @ ('+' | '-')) = self.peek() {
                sign = if c == '-' { -sign } else { sign };
                self.at += 1;
                self.skip_spaces();
            }
            let (weight, term) = self.term()?;
            terms.push((sign * weight, term));
        }
    }

    fn term(&mut self) -> Result<(f64, Functional), ExpressionError> {
        match self.peek() {
            None => self
                .fail("the expression ends here; a functional such as bending is missing".into()),
            Some(c) if c.is_ascii_digit() || c == '.' => {
                let weight = self.number()?;
                self.skip_spaces();
                if self.peek() == Some('*') {
                    self.at += 1;
                    self.skip_spaces();
                }
                Ok((weight, self.functional()?))
            }
            Some(_) => {
                let functional = self.functional()?;
                self.skip_spaces();
                if self.peek() != Some('*') {
                    return Ok((1.0, functional));
                }
                self.at += 1;
                self.skip_spaces();
                Ok((self.number()?, functional))
            }
        }
    }

    fn functional(&mut self) -> Result<Functional, ExpressionError> {
        let start = self.at;
        while self.peek().is_some_and(|c| c.is_ascii_alphanumeric() || c == '_') {
            self.at += 1;
        }
        let name: String = self.chars[start..self.at].iter().collect();
        let known = Functional::ALL.into_iter().find(|f| f.name() == name);
        let Some(functional) = known else {
            self.at = start;
            let names: Vec<_> = Functional::ALL.iter().map(|f| f.name()).collect();
            let found = match (name.is_empty(), self.peek()) {
                (true, Some(c)) => format!("found '{c}'"),
                (true, None) => "the expression ends here".to_owned(),
                _ => format!("'{name}' is not a functional"),
            };
            return self.fail(format!("{found}; the functionals are {}", names.join(", ")));
        };
        self.skip_spaces();
        if self.peek() != Some('(') {
            return Ok(functional);
        }
        if !matches!(functional, Functional::MehlumTarrou { .. }) {
            return self.fail(format!("{name} takes no weights; only mehlum_tarrou(w1, w3) does"));
        }
        self.at += 1;
        let w1 = self.signed_number()?;
        self.expect(',')?;
        let w3 = self.signed_number()?;
        self.expect(')')?;
        Ok(Functional::MehlumTarrou { w1, w3 })
    }

    fn signed_number(&mut self) -> Result<f64, ExpressionError> {
        self.skip_spaces();
        let sign = if self.peek() == Some('-') {
            self.at += 1;
            -1.0
        } else {
            1.0
        };
        Ok(sign * self.number()?)
    }

    fn number(&mut self) -> Result<f64, ExpressionError> {
        let start = self.at;
        while let Some(c) = self.peek() {
            let exponent_sign = matches!(c, '+' | '-')
                && self.at > start
                && matches!(self.chars[self.at - 1], 'e' | 'E');
            // An 'e' belongs to the number only if digits follow.
            let exponent = matches!(c, 'e' | 'E')
                && self.chars[self.at + 1..]
                    .iter()
                    .find(|c| !matches!(c, '+' | '-'))
                    .is_some_and(char::is_ascii_digit);
            if !(c.is_ascii_digit() || c == '.' || exponent || exponent_sign) {
                break;
            }
            self.at += 1;
        }
        let digits: String = self.chars[start..self.at].iter().collect();
        match digits.parse::<f64>() {
            _ if digits.is_empty() => {
                let found = self.peek().map_or("the end".to_owned(), |c| format!("'{c}'"));
                self.fail(format!("found {found}, expected a number"))
            }
            Ok(number) if number.is_finite() => Ok(number),
            _ => {
                self.at = start;
                self.fail(format!("'{digits}' is not a finite number"))
            }
        }
    }

    fn expect(&mut self, wanted: char) -> Result<(), ExpressionError> {
        self.skip_spaces();
        if self.peek() == Some(wanted) {
            self.at += 1;
            return Ok(());
        }
        let found = self.peek().map_or("the end".to_owned(), |c| format!("'{c}'"));
        self.fail(format!("found {found}, expected '{wanted}'"))
    }

    fn peek(&self) -> Option<char> {
        self.chars.get(self.at).copied()
    }

    fn skip_spaces(&mut self) {
        while self.peek().is_some_and(char::is_whitespace) {
            self.at += 1;
        }
    }

    fn fail<T>(&self, message: String) -> Result<T, ExpressionError> {
        Err(ExpressionError { text: self.text.to_owned(), position: self.at, message })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_products_and_weights_are_read() {
        let energy: Energy = "0.92*bending + 0.08*mehlum_tarrou".parse().unwrap();
        assert_eq!(
            energy.terms,
            [(0.92, Functional::Bending), (0.08, Functional::MehlumTarrou { w1: 1.0, w3: 1.0 })]
        );
        let energy: Energy = " - area * 2e-1 + 3 mehlum_tarrou( 1, -0.5 )".parse().unwrap();
        assert_eq!(
            energy.terms,
            [(-0.2, Functional::Area), (3.0, Functional::MehlumTarrou { w1: 1.0, w3: -0.5 })]
        );
        let again: Energy = energy.to_string().parse().unwrap();
        assert_eq!(again, energy);
        for functional in Functional::ALL {
            assert_eq!(functional.name().parse::<Energy>().unwrap().terms, [(1.0, functional)]);
        }
    }

    #[test]
    fn errors_point_at_the_place() {
        let at = |text: &str| text.parse::<Energy>().unwrap_err().position;
        assert_eq!(at(""), 0);
        assert_eq!(at("bending +"), 9);
        assert_eq!(at("0.5*bendin"), 4);
        assert_eq!(at("bending willmore"), 8);
        assert_eq!(at("bending(1,2)"), 7);
        assert_eq!(at("mehlum_tarrou(1;2)"), 15);
        assert_eq!(at("1.2.3*area"), 0);
        let error = "2*bending + 3*foo".parse::<Energy>().unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("energy expression, position 14: 'foo' is not a functional")
        );
        assert!(error.to_string().ends_with(", in '2*bending + 3*foo'"));
    }
}
