"""What is there to calibrate from: points, boards, wands, courts, people; each read and made evidence."""
