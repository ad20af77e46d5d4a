"""Break-aways: static friction over stick time and force rate."""
