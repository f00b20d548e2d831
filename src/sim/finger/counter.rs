//! How often each effect did its work.
//!
//! Only builds with debug assertions count, per thread; in a release build the calls are empty,
//! so that counting costs nothing where time is measured.

#[cfg(debug_assertions)]
use std::cell::RefCell;

#[cfg(debug_assertions)]
thread_local! {
    static COUNTS: RefCell<Vec<(&'static str, u64)>> = const { RefCell::new(Vec::new()) };
}

/// Notes that `effect`, named as in the scene, did its work once on this thread.
#[inline]
pub fn count(effect: &'static str) {
    #[cfg(debug_assertions)]
    COUNTS.with_borrow_mut(|counts| match counts.iter_mut().find(|(name, _)| *name == effect) {
        Some((_, count)) => *count += 1,
        None => counts.push((effect, 1)),
    });
    #[cfg(not(debug_assertions))]
    let _ = effect;
}

/// How often `effect` did its work on this thread; none in a build that does not count.
pub fn count_of(effect: &str) -> Option<u64> {
    #[cfg(debug_assertions)]
    return Some(COUNTS.with_borrow(|counts| {
        counts.iter().find(|(name, _)| *name == effect).map_or(0, |(_, count)| *count)
    }));
    #[cfg(not(debug_assertions))]
    {
        let _ = effect;
        None
    }
}

/// How often any effect did its work on this thread; none in a build that does not count.
pub fn total() -> Option<u64> {
    #[cfg(debug_assertions)]
    return Some(COUNTS.with_borrow(|counts| counts.iter().map(|(_, count)| count).sum()));
    #[cfg(not(debug_assertions))]
    None
}
