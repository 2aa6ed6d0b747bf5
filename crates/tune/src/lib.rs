//! Search space, score and derivative-free search.
