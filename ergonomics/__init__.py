"""How bad a posture or effort is: RULA, REBA, back angle, articular stress."""
