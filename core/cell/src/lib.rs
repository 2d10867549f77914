//! The orchestrator: workcell files, devices, procedures, safety and corrections.
