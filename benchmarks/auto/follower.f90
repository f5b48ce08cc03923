! Follower load, statics: an unshearable, inextensible rod of length 1 with m = (k1, 10 k2, k3), clamped at s = 0,
! pushed by a force P against d3 at s = 1.
!
!   unknowns   q (4), m (3)                                   parameters   1 P   2 N1   3 N2   4 N3
!   the equations of rod.f90;   q(0) = 1,   m(1) = 0,   N = -P d3(1)
!
! Free: P and 10 - 7 = 3 more parameters. The straight rod is a solution at every P, and no other meets it: AUTO finds
! no branch point, and no statics can find the flutter. See flutter.f90.
module follower_law
   use rod, only: dp
   implicit none
contains
   pure subroutine law(m, n3, k, v, dk, dv)
      real(dp), intent(in) :: m(3), n3
      real(dp), intent(out) :: k(3), v, dk(3, 4), dv(4)
      k = [m(1), m(2)/10, m(3)]
      v = 1                                                           ! inextensible: n3 has no say
      dk = 0; dk(1, 1) = 1; dk(2, 2) = 0.1_dp; dk(3, 3) = 1
      dv = 0
   end subroutine
end module follower_law

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
   use rod, only: dp, rod_rhs
   use follower_law, only: law
   implicit none
   integer, intent(in) :: ndim, icp(*), ijac
   real(dp), intent(in) :: u(ndim), par(*)
   real(dp), intent(out) :: f(ndim)
   real(dp), intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
   real(dp) :: all(10), df(10, 10)

   call rod_rhs(law, u(1:4), u(5:7), par(2:4), ijac > 0, all, df)
   f = all(1:7)
   if (ijac == 0) return
   dfdu = df(1:7, 1:7)
   if (ijac == 1) return
   dfdp(:, 1) = 0
   dfdp(:, 2:4) = df(1:7, 8:10)
end subroutine

subroutine stpnt(ndim, u, par, t)
   use rod, only: dp
   implicit none
   integer, intent(in) :: ndim
   real(dp), intent(inout) :: u(ndim), par(*)
   real(dp), intent(in) :: t
   par(1:4) = 0
   u = [1._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp]
end subroutine

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
   use rod, only: dp, directors, held
   implicit none
   integer, intent(in) :: ndim, icp(*), nbc, ijac
   real(dp), intent(in) :: par(*), u0(ndim), u1(ndim)
   real(dp), intent(out) :: fb(nbc)
   real(dp), intent(inout) :: dbc(nbc, *)
   real(dp) :: R(3, 3), q(4)
   integer :: i
   q = u1(1:4)
   call directors(q, R)
   call held([1, 2, 3, 4], [5, 6, 7], 4, u0, u1, fb, ijac, dbc)
   fb(1) = fb(1) - 1
   fb(8:10) = par(2:4) + par(1)*R(:, 3)
   if (ijac == 0) return
   dbc(8, ndim + 1:ndim + 4) = 2*par(1)*[q(3), q(4), q(1), q(2)]
   dbc(9, ndim + 1:ndim + 4) = 2*par(1)*[-q(2), -q(1), q(4), q(3)]
   dbc(10, ndim + 1:ndim + 4) = 2*par(1)*[q(1), -q(2), -q(3), q(4)]
   if (ijac == 1) return
   dbc(8:10, 2*ndim + 1) = R(:, 3)
   do i = 1, 3
      dbc(7 + i, 2*ndim + 1 + i) = 1
   end do
end subroutine

subroutine pvls
end subroutine
