"""One least-squares kernel for every fit: parameters, minimization, covariance and intervals. Knows no friction."""
