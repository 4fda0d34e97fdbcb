"""Colors of pictures and figures: those of Okabe and Ito, which the color-blind can tell apart."""

FILAMENT_COLORS = ("#0072B2", "#009E73", "#56B4E9", "#6B6B6B")
LINKER_COLORS = ("#E69F00", "#D55E00", "#CC79A7", "#F0E442")
