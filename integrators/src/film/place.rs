//! Where on a block's film contributions go.

use crate::contribution::Contribution;
use crate::request::Request;
use sampling::Spectrum;

/// A block's film, however it places what it is given.
pub trait Place {
    /// What is asked for.
    fn request(&self) -> &Request;

    /// The layer of the series that a contribution belongs to, and its share; `None` for what is not wanted or, and then it is
    /// counted, not finite.
    fn counted(&mut self, c: &Contribution) -> Option<(usize, Spectrum)>;

    /// Adds to what the sample at work has brought to a layer that it does not itself count in: the unweighted contribution.
    fn count_unweighted(&mut self, layer: usize, c: &Contribution);

    /// Adds to successive layers where a contribution lands.
    fn place<const N: usize>(&mut self, c: &Contribution, layer: usize, values: [Spectrum; N]);

    /// The same of what is no light, such as a number of contributions: all samples count alike.
    fn place_alike(&mut self, c: &Contribution, layer: usize, value: Spectrum) {
        self.place(c, layer, [value]);
    }
}
