//! Files of `vsj export`.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`library`] | compiled libraries, and where they are found |
//! | [`c`] | the settings as a header, and an example around them |
//! | [`fmu`] | archives of co-simulation units |
//! | [`model`] | the spring's model as the bytes that an MCU stores |

pub mod c;
pub mod fmu;
pub mod library;
pub mod model;
