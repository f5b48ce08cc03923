! Telephone cord: an unshearable, inextensible rod of length 1 with intrinsic curvature k0 = 3 pi about d2,
!
!   k1 = m1,   k2 = m2 + k0,   k3 = m3,   v = 1,
!
! both ends clamped with R = I, and pulled along e3 by the dead tension lam.
!
!   unknowns   q (4), m (3), r (3)                            parameters   1 lam   2 N1   3 N2   4 eps
!   q' = 1/2 q (0, k) + eps q,   m, r as in rod.f90 with N = (N1, N2, lam)
!   q(0) = 1,   q(1) = 1,   r(0) = 0,   r1(1) = r2(1) = 0
!
! The 13 boundary conditions count |q| = 1 twice; eps, zero at every solution, takes up the surplus one. Hence lam
! and 13 - 10 = 3 more parameters are free. PAR(5) is the shortening 1 - r3(1).
! On the straight state q = 1, m = (0, -k0, 0), r = s e3.
module cord_law
   use rod, only: dp
   implicit none
   real(dp), parameter :: k0 = 9.42477796076937971538793014983850865_dp
contains
   pure subroutine law(m, n3, k, v, dk, dv)
      real(dp), intent(in) :: m(3), n3
      real(dp), intent(out) :: k(3), v, dk(3, 4), dv(4)
      k = [m(1), m(2) + k0, m(3)]
      v = 1                                                           ! inextensible: n3 has no say
      dk = 0; dk(1, 1) = 1; dk(2, 2) = 1; dk(3, 3) = 1
      dv = 0
   end subroutine
end module cord_law

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
   use rod, only: dp, rod_rhs
   use cord_law, only: law
   implicit none
   integer, intent(in) :: ndim, icp(*), ijac
   real(dp), intent(in) :: u(ndim), par(*)
   real(dp), intent(out) :: f(ndim)
   real(dp), intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
   real(dp) :: df(10, 10)
   integer :: i

   call rod_rhs(law, u(1:4), u(5:7), [par(2), par(3), par(1)], ijac > 0, f, df)
   f(1:4) = f(1:4) + par(4)*u(1:4)
   if (ijac == 0) return
   dfdu(:, 1:7) = df(:, 1:7)
   dfdu(:, 8:10) = 0
   do i = 1, 4
      dfdu(i, i) = dfdu(i, i) + par(4)
   end do
   if (ijac == 1) return
   dfdp(:, 1) = df(:, 10)
   dfdp(:, 2) = df(:, 8)
   dfdp(:, 3) = df(:, 9)
   dfdp(1:4, 4) = u(1:4)
   dfdp(5:10, 4) = 0
end subroutine

subroutine stpnt(ndim, u, par, t)
   use rod, only: dp
   use cord_law, only: k0
   implicit none
   integer, intent(in) :: ndim
   real(dp), intent(inout) :: u(ndim), par(*)
   real(dp), intent(in) :: t
   par(1:5) = [60._dp, 0._dp, 0._dp, 0._dp, 0._dp]
   u = [1._dp, 0._dp, 0._dp, 0._dp, 0._dp, -k0, 0._dp, 0._dp, 0._dp, t]
end subroutine

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
   use rod, only: dp, held
   implicit none
   integer, intent(in) :: ndim, icp(*), nbc, ijac
   real(dp), intent(in) :: par(*), u0(ndim), u1(ndim)
   real(dp), intent(out) :: fb(nbc)
   real(dp), intent(inout) :: dbc(nbc, *)
   call held([1, 2, 3, 4, 8, 9, 10], [1, 2, 3, 4, 8, 9], 4, u0, u1, fb, ijac, dbc)
   fb([1, 8]) = fb([1, 8]) - 1
end subroutine

subroutine pvls(ndim, u, par)
   use rod, only: dp
   implicit none
   integer, intent(in) :: ndim
   real(dp), intent(in) :: u(ndim)
   real(dp), intent(inout) :: par(*)
   real(dp), external :: getp
   par(5) = 1 - getp('BV1', 10, u)
end subroutine
