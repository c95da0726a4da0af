//! The plots and pictures of a report as files in memory.

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::diagram::diagram_svg;
use crate::energies::energies_svg;
use crate::histogram::histogram_svg;
use crate::picture::{Layer, picture_png};
use crate::text::file_word;
use crate::{Report, ReportError};

/// A file in memory; the caller writes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Figure {
    /// File name with its extension, of lower-case letters, digits and `-`.
    pub name: String,
    /// The content.
    pub bytes: Vec<u8>,
}

impl Report {
    /// The plots of the page as SVG, and a shaded PNG picture of every field and grouping of
    /// every stage. Names follow what they show: `histogram-kinks.svg`, `energies.svg`,
    /// `after-diagram.svg`, `after-k.png`.
    ///
    /// # Errors
    /// [`ReportError::Picture`] if a picture cannot be encoded.
    pub fn figures(&self) -> Result<Vec<Figure>, ReportError> {
        let mut figures = Vec::new();
        let mut plot = |name: String, svg: String| {
            figures.push(Figure { name, bytes: svg.into_bytes() });
        };
        for histogram in &self.histograms {
            plot(format!("histogram-{}.svg", file_word(&histogram.id)), histogram_svg(histogram));
        }
        if let Some(history) = &self.energies {
            plot("energies.svg".to_owned(), energies_svg(history));
        }
        for (index, view) in self.stages.iter().enumerate() {
            // What came first lies behind all that follows.
            let behind = self.stages.first().filter(|_| index > 0);
            if let Some(svg) = diagram_svg(view, behind, &self.relations) {
                plot(format!("{}-diagram.svg", file_word(view.name())), svg);
            }
        }
        let mut pictures = Vec::new();
        for view in &self.stages {
            let stage = file_word(view.name());
            for field in view.fields() {
                let name = format!("{stage}-{}.png", file_word(&field.id));
                pictures.push((name, view, Layer::Field(field)));
            }
            for groups in view.groups() {
                let name = format!("{stage}-{}.png", file_word(&groups.id));
                pictures.push((name, view, Layer::Groups(groups)));
            }
        }
        let drawn = pictures.into_par_iter().map(|(name, view, layer)| {
            let bytes = picture_png(view, layer, &self.length_unit);
            bytes.map(|bytes| Figure { name, bytes })
        });
        // `collect` keeps the order of the list, whatever the number of threads.
        let drawn: Result<Vec<Figure>, ReportError> = drawn.collect();
        figures.extend(drawn?);
        number_duplicates(&mut figures);
        Ok(figures)
    }
}

/// Two stages of one name must not overwrite each other's figures.
fn number_duplicates(figures: &mut [Figure]) {
    let mut taken = BTreeSet::new();
    for figure in figures {
        let (stem, extension) = figure.name.rsplit_once('.').unwrap_or((&figure.name, ""));
        let numbered = (2..).map(|count| format!("{stem}-{count}.{extension}"));
        let mut names = std::iter::once(figure.name.clone()).chain(numbered);
        if let Some(free) = names.find(|name| taken.insert(name.clone())) {
            figure.name = free;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_names_get_numbers() {
        let figure = |name: &str| Figure { name: name.into(), bytes: Vec::new() };
        let mut figures = ["a.svg", "a.svg", "b.svg", "a-2.svg", "a.svg"].map(figure);
        number_duplicates(&mut figures);
        let names = figures.map(|f| f.name);
        assert_eq!(names, ["a.svg", "a-2.svg", "b.svg", "a-2-2.svg", "a-3.svg"]);
    }
}
