//! What happened: runs, steps, answers, trigger poses, corrections and model revisions.
