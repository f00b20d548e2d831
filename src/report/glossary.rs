//! Glossary of the pages: terms with the explanations that their tooltips show.

use super::canvas::escape;

/// Terms with their explanations; case is ignored in ASCII letters.
const TERMS: &[(&str, &str)] = &[
    (
        "R (Eq. 5)",
        "Correlation of estimated and true heights without subtracting their means (Yi et al. 2016, \
         Eq. 5); 1 is perfect.",
    ),
    (
        "centred R",
        "Correlation of estimated and true heights after subtracting each one's mean; 1 is perfect.",
    ),
    ("RMSE", "Root mean square error of the estimated heights."),
    (
        "95 % band",
        "Interval that contains the true surface with a probability of 95 %, according to the belief.",
    ),
    (
        "NLPD",
        "Negative log predictive density of the truth under the belief; less is better, and an \
         overconfident belief scores badly.",
    ),
    ("Brier", "Mean squared error of the probability that a place has a surface; 0 is perfect."),
    ("IoU", "Intersection over union of the estimated and the true shape; 1 is perfect."),
    (
        "intersection over union",
        "Overlap of the estimated and the true shape, divided by their union; 1 is perfect.",
    ),
    (
        "Chamfer distance",
        "Mean distance between the estimated and the true surface, averaged over both directions.",
    ),
    (
        "F-score",
        "Harmonic mean of the fractions of the estimated and of the true surface that lie within a \
         distance of the other; 1 is perfect.",
    ),
    (
        "ADD-S",
        "Mean distance between the surfaces of the object at the true and at the estimated pose.",
    ),
    ("confusion matrices", "Numbers of trials by true and by recognised object."),
    ("standard deviation", "Uncertainty of the belief, σ of the Gaussian process."),
    ("posterior mean", "Mean of the Gaussian process, conditioned on the touches."),
    (
        "bootstrap",
        "Interval of a statistic over many samples of the trials, drawn with replacement.",
    ),
    ("standard error", "Standard deviation of a mean of several trials."),
    ("geometric mean", "Exponential of the mean logarithm."),
    ("interquartile mean", "Mean of the middle half of the values."),
    ("calibrated", "The 95 % band contains about 95 % of the truth."),
    ("overconfident", "The 95 % band contains too little of the truth."),
    ("underconfident", "The 95 % band is wider than necessary."),
    ("baseline", "Planner with which the others are compared."),
    ("planner", "Method that selects the next target."),
    ("belief", "Surface with its uncertainty, estimated by a Gaussian process from the touches."),
    ("length scale", "Distance over which the Gaussian process correlates heights."),
    ("datum", "Plane from which heights are measured."),
    ("initial touches", "Touches that all planners share before the first fit."),
    ("lateral travel", "Path between the targets, across the approach, summed over a trial."),
];

/// Returns whether the text from `start` to `end` is not part of a longer word.
fn is_word(text: &str, start: usize, end: usize) -> bool {
    let before = text[..start].chars().next_back();
    let after = text[end..].chars().next();
    !before.is_some_and(char::is_alphanumeric) && !after.is_some_and(char::is_alphanumeric)
}

/// Returns the byte of the first occurrence of `term` in `text`, from the byte `from` on.
fn find(text: &str, term: &str, from: usize) -> Option<usize> {
    let is_here = |start: &usize| {
        let end = start + term.len();
        let found = text.get(*start..end);
        found.is_some_and(|found| found.eq_ignore_ascii_case(term)) && is_word(text, *start, end)
    };
    (from..text.len()).find(is_here)
}

/// Returns the explanation of the longest term in `text`; `None` without a term.
pub(super) fn tooltip(text: &str) -> Option<&'static str> {
    let found = TERMS.iter().filter(|(term, _)| find(text, term, 0).is_some());
    found.max_by_key(|(term, _)| term.len()).map(|(_, explanation)| *explanation)
}

/// Returns a plain text as HTML, with a tooltip on the first occurrence of each term.
pub(super) fn explained(text: &str) -> String {
    let mut html = String::new();
    let mut from = 0;
    let mut terms: Vec<(&str, &str)> = TERMS.to_vec();
    loop {
        let found = terms.iter().enumerate().filter_map(|(i, (term, _))| {
            let start = find(text, term, from)?;
            Some((start, usize::MAX - term.len(), i))
        });
        let Some((start, _, i)) = found.min() else { break };
        let (term, explanation) = terms.remove(i);
        let end = start + term.len();
        html += &escape(&text[from..start]);
        let (word, explanation) = (escape(&text[start..end]), escape(explanation));
        html += &format!("<abbr title=\"{explanation}\">{word}</abbr>");
        from = end;
    }
    html + &escape(&text[from..])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first occurrence of a whole word has a tooltip; other text is escaped.
    #[test]
    fn a_term_is_explained_once() {
        let html = explained("RMSE < 1 mm & RMSE, XRMSE; 95 % band");
        assert_eq!(html.matches("<abbr").count(), 2, "{html}");
        assert!(html.starts_with("<abbr title=\"Root mean square"), "{html}");
        assert!(html.contains("</abbr> &lt; 1 mm &amp; RMSE, XRMSE; <abbr"), "{html}");
        assert!(tooltip("median RMSE, mm").is_some() && tooltip("armse").is_none());
    }
}
