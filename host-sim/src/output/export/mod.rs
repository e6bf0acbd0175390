//! Files of `vsj export`.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`library`] | compiled libraries, and where they are found |
//! | [`fmu`] | archives of co-simulation units |

pub mod fmu;
pub mod library;
