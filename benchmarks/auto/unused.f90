! What AUTO links but no problem here has: integral conditions and an objective function.
subroutine icnd
end subroutine

subroutine fopt
end subroutine
