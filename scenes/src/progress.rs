//! How far work is that takes long before any image grows: the loading of a scene, and what methods make of it; for those who wait for it.

use std::cell::RefCell;

/// What is going on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// A file of a mesh is read.
    Reading,
    /// The tree over surfaces is built.
    Building,
    /// Elements of its surfaces are coupled.
    Coupling,
}

type Observer = Box<dyn FnMut(Activity, f64)>;

thread_local! {
    static OBSERVER: RefCell<Option<Observer>> = const { RefCell::new(None) };
}

/// Does `work`, such as [`load`](crate::load()), and lets `observer` know from time to time what share of an activity is done, in [0, 1].
/// There may be several of each kind. Where little is to be done nothing is told.
pub fn observed<T>(observer: impl FnMut(Activity, f64) + 'static, work: impl FnOnce() -> T) -> T {
    /// Puts the observer back that there was before, even if the work panics.
    struct Restore(Option<Observer>);
    impl Drop for Restore {
        fn drop(&mut self) {
            OBSERVER.set(self.0.take());
        }
    }
    let _restore = Restore(OBSERVER.replace(Some(Box::new(observer))));
    work()
}

/// Tells who asked on this thread.
pub fn report(activity: Activity, share: f64) {
    OBSERVER.with_borrow_mut(|observer| {
        if let Some(observer) = observer {
            observer(activity, share);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::rc::Rc;

    #[test]
    fn observers_are_told_only_during_their_work() {
        let sum = Rc::new(Cell::new(0.0));
        let seen = sum.clone();
        report(Activity::Reading, 1.0);
        observed(move |_, share| seen.set(seen.get() + share), || report(Activity::Building, 0.25));
        report(Activity::Reading, 1.0);
        assert_eq!(sum.get(), 0.25);
    }
}
