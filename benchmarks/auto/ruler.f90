! Ruler: an unshearable rod of length 1, clamped at s = 0, pushed by a dead force lam e1 at s = 1, with
!
!   k1 = m1,   k2 = m2/10,   k3 = m3,   v = exp(n3/20)        (n3 = 20 log v)
!
!   unknowns   q (4), m (3), r2                               parameters   1 lam
!   the equations of rod.f90 with N = (lam, 0, 0)
!   q(0) = 1,   m(1) = 0,   r2(0) = 0
!
! No force is unknown and |q| = 1 is asked for once: lam alone is free. Of the centreline only r2 is carried along, for
! the displacement of the tip out of the plane, PAR(2) = |r2(1)|.
module ruler_law
   use rod, only: dp
   implicit none
contains
   pure subroutine law(m, n3, k, v, dk, dv)
      real(dp), intent(in) :: m(3), n3
      real(dp), intent(out) :: k(3), v, dk(3, 4), dv(4)
      k = [m(1), m(2)/10, m(3)]
      v = exp(n3/20)
      dk = 0; dk(1, 1) = 1; dk(2, 2) = 0.1_dp; dk(3, 3) = 1
      dv = [0._dp, 0._dp, 0._dp, v/20]
   end subroutine
end module ruler_law

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
   use rod, only: dp, rod_rhs
   use ruler_law, only: law
   implicit none
   integer, intent(in) :: ndim, icp(*), ijac
   real(dp), intent(in) :: u(ndim), par(*)
   real(dp), intent(out) :: f(ndim)
   real(dp), intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
   integer, parameter :: kept(8) = [1, 2, 3, 4, 5, 6, 7, 9]           ! q, m, r2 among q, m, r
   real(dp) :: all(10), df(10, 10)

   call rod_rhs(law, u(1:4), u(5:7), [par(1), 0._dp, 0._dp], ijac > 0, all, df)
   f = all(kept)
   if (ijac == 0) return
   dfdu(:, 1:7) = df(kept, 1:7)
   dfdu(:, 8) = 0
   if (ijac == 1) return
   dfdp(:, 1) = df(kept, 8)
end subroutine

subroutine stpnt(ndim, u, par, t)
   use rod, only: dp
   implicit none
   integer, intent(in) :: ndim
   real(dp), intent(inout) :: u(ndim), par(*)
   real(dp), intent(in) :: t
   par(1:2) = 0
   u = [1._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp]
end subroutine

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
   use rod, only: dp, held
   implicit none
   integer, intent(in) :: ndim, icp(*), nbc, ijac
   real(dp), intent(in) :: par(*), u0(ndim), u1(ndim)
   real(dp), intent(out) :: fb(nbc)
   real(dp), intent(inout) :: dbc(nbc, *)
   call held([1, 2, 3, 4, 8], [5, 6, 7], 1, u0, u1, fb, ijac, dbc)
   fb(1) = fb(1) - 1
end subroutine

subroutine pvls(ndim, u, par)
   use rod, only: dp
   implicit none
   integer, intent(in) :: ndim
   real(dp), intent(in) :: u(ndim)
   real(dp), intent(inout) :: par(*)
   real(dp), external :: getp
   par(2) = abs(getp('BV1', 8, u))
end subroutine
