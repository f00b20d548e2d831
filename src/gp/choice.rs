//! A choice of kernels by how likely each makes the observations.

use super::fit::{Fit, Refits};
use super::kernel;
use super::kernel::Kernel;
use super::observations::Observations;
use super::search_box::SearchBox;

/// One or several kernels, of which each fit chooses the likeliest.
#[derive(Clone)]
pub struct Choice {
    candidates: Vec<Candidate>,
    chosen: usize,
}

#[derive(Clone)]
struct Candidate {
    name: &'static str,
    fits: Refits,
}

impl Choice {
    /// Between the kernels of these names, the first until there is a fit. Unknown names are passed
    /// over; with none left it is the squared exponential.
    pub fn between(names: &[String]) -> Self {
        let known = |name: &&(&str, &dyn Kernel)| names.iter().any(|asked| asked == name.0);
        let candidate = |(name, kernel): &(&'static str, &'static dyn Kernel)| Candidate {
            name,
            fits: Refits::of(*kernel),
        };
        let mut candidates: Vec<Candidate> =
            kernel::KERNELS.iter().filter(known).map(candidate).collect();
        if candidates.is_empty() {
            candidates.extend(kernel::KERNELS.first().map(candidate));
        }
        Self { candidates, chosen: 0 }
    }

    /// The chosen one.
    pub fn kernel(&self) -> &'static dyn Kernel {
        self.candidates[self.chosen].fits.kernel()
    }

    /// Whether all of them can observe slopes.
    pub fn has_slopes(&self) -> bool {
        self.candidates.iter().all(|candidate| candidate.fits.kernel().has_slopes())
    }

    /// Fits all and chooses the likeliest. Names it if there was a choice; the factorisations are
    /// those of all.
    pub fn fit(&mut self, search_box: &SearchBox, observations: &Observations) -> Fit {
        let fit = |candidate: &mut Candidate| candidate.fits.fit(search_box, observations);
        let fits: Vec<Fit> = self.candidates.iter_mut().map(fit).collect();
        let likelihood = |i: &usize| fits[*i].log_likelihood;
        // Of equals the first.
        let likeliest =
            (0..fits.len()).rev().max_by(|a, b| likelihood(a).total_cmp(&likelihood(b)));
        self.chosen = likeliest.unwrap_or(0);
        let mut fit = fits[self.chosen].clone();
        fit.factorisations = fits.iter().map(|fit| fit.factorisations).sum();
        if let [_, _, ..] = self.candidates[..] {
            fit.kernel = Some(self.candidates[self.chosen].name.into());
        }
        fit
    }

    /// Chooses what `fit` chose.
    pub fn follow(&mut self, fit: &Fit) {
        let named = |candidate: &Candidate| Some(candidate.name) == fit.kernel.as_deref();
        self.chosen = self.candidates.iter().position(named).unwrap_or(0);
    }
}
