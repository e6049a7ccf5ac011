//! Work on all processors.

use std::sync::Mutex;

/// Does work block by block on all threads, each with a state that `make` makes. Whoever is free takes the next block:
/// fixed shares would let one thread wait for another, because files are read and written meanwhile.
#[inline]
pub fn on_all_threads<B, S>(
    blocks: impl IntoIterator<Item = B, IntoIter: Send>,
    make: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, B) + Sync,
) {
    let blocks = Mutex::new(blocks.into_iter());
    rayon::broadcast(|_| {
        let mut state = None;
        loop {
            let next = blocks.lock().expect("taking a block does not panic").next();
            let Some(block) = next else { break };
            work(state.get_or_insert_with(&make), block);
        }
    });
}
