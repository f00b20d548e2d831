//! Calibration of skin and electrodes from recordings of fingers pressed on a flat plate.
//!
//! A recording depends on its sensor and its contact. All electrodes read more than in the session
//! without contact, by one factor of conductivity (a sensor without contact has that factor alone:
//! 1.08 and 1.2 in MiaoLi/syntouchcontact's recordings). The sensitivity differs between sensors,
//! and the attitude of the finger, which was held by hand, is not recorded. `session` has these
//! parameters, separate from the `constants`, which all sensors share. `fit` fits both to all loads
//! and estimates the uncertainty; `score` tests the constants on a held-out sensor, against
//! baselines that do not use force. `shear` compares the model with the measured response of
//! electrodes to tangential force.

pub mod constants;
pub mod fit;
pub mod score;
pub mod session;
pub mod shear;
