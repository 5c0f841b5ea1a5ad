"""What several missions of rigid-body aircraft share: motion, trim, measurements, estimators, control laws."""
