"""The study of Cirelli, Rossi, Valentini and Pennestri (2021), reproduced: its tables, figures and statements."""
