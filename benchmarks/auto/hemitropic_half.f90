! Compressed hemitropic rod (hemitropic_law.f90), half of it: states that a half turn F = diag(1, -1, -1) about e1
! takes to themselves reversed, r(-s) = F r(s), R(-s) = F R(s) F.
!
!   unknowns   q (4), m (3), r (3) on s in [0, l]             parameters   1 lam   2 N2   3 N3
!   the equations of rod.f90 with N = (0, N2, N3)
!   q2 = q3 = 0 (of q = q0 + q1 i + q2 j + q3 k),   m1 = 0,   r2 = r3 = 0                        at s = 0
!   q = 1,   r = l (1 - lam) e3                                                                  at s = l
!
! No symmetry is left, and |q| = 1 is asked for once: no drift, no eps. Free: lam and 12 - 10 = 2 more parameters.
! PAR(4) is |r1(0)|, the transverse displacement of the mid point.
subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
   use rod, only: dp, rod_rhs
   use hemitropic_law, only: law, half_length
   implicit none
   integer, intent(in) :: ndim, icp(*), ijac
   real(dp), intent(in) :: u(ndim), par(*)
   real(dp), intent(out) :: f(ndim)
   real(dp), intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
   real(dp) :: df(10, 10)

   call rod_rhs(law, u(1:4), u(5:7), [0._dp, par(2), par(3)], ijac > 0, f, df)
   f = half_length*f
   if (ijac == 0) return
   dfdu(:, 1:7) = half_length*df(:, 1:7)
   dfdu(:, 8:10) = 0
   if (ijac == 1) return
   dfdp(:, 1) = 0
   dfdp(:, 2:3) = half_length*df(:, 9:10)
end subroutine

subroutine stpnt(ndim, u, par, t)
   use rod, only: dp
   use hemitropic_law, only: half_length
   implicit none
   integer, intent(in) :: ndim
   real(dp), intent(inout) :: u(ndim), par(*)
   real(dp), intent(in) :: t
   par(1:4) = 0
   u = [1._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp, half_length*t]
end subroutine

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
   use rod, only: dp, held
   use hemitropic_law, only: half_length
   implicit none
   integer, intent(in) :: ndim, icp(*), nbc, ijac
   real(dp), intent(in) :: par(*), u0(ndim), u1(ndim)
   real(dp), intent(out) :: fb(nbc)
   real(dp), intent(inout) :: dbc(nbc, *)
   call held([3, 4, 5, 9, 10], [1, 2, 3, 4, 8, 9, 10], 3, u0, u1, fb, ijac, dbc)
   fb(6) = fb(6) - 1
   fb(12) = fb(12) - half_length*(1 - par(1))
   if (ijac == 2) dbc(12, 2*ndim + 1) = half_length
end subroutine

subroutine pvls(ndim, u, par)
   use rod, only: dp
   implicit none
   integer, intent(in) :: ndim
   real(dp), intent(in) :: u(ndim)
   real(dp), intent(inout) :: par(*)
   real(dp), external :: getp
   par(4) = abs(getp('BV0', 8, u))
end subroutine
