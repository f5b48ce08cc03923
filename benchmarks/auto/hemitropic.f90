! Compressed hemitropic rod (hemitropic_law.f90), the whole of it, between aligned clamps:
!
!   unknowns   q (4), m (3), r (3) on s in [-l, l]            parameters   1 lam   2 N2   3 N3   4 eps   5 delta
!   q' = 1/2 q (0, k) + eps q,   m' = ... + delta R^t t with t = -r3 e1,   r as in rod.f90 with N = (0, N2, N3)
!   q(-l) = q(l) = 1,   r(-l) = -l (1 - lam) e3,   r(l) = l (1 - lam) e3
!
! As in cord.f90 eps, zero at every solution, takes up the surplus condition |q| = 1. A rotation about e3 takes
! solutions to solutions. The phase condition N1 = 0 picks one of the circle: rods that a half turn about e1 takes to
! themselves (reversed), of which there are buckled ones only. In place of N1 comes the drift delta, the size of a
! distributed torque along t. It must vanish at every solution because the torques of every solution are orthogonal to
! the generator (e3 - d3, e3 x r) of the symmetry, and t is not: int t.(e3 - d3) = int r3 d3.e1. On the straight
! rod, where the generator is zero, this torque makes each of the double eigenvalues simple, so that AUTO sees a sign
! change; and it brings no others (a torque r3 e2, of the other parity, would do).
! The 14 boundary conditions leave lam and 14 - 10 = 4 parameters free. Time is scaled to t = (s/l + 1)/2.
! On the straight state q = 1, m = 0 with the twist held: k3 = 0, v = 1 - lam, m3 = -A lam, N3 = -D lam.
subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
   use rod, only: dp, directors, transposed_times, rod_rhs
   use hemitropic_law, only: law, half_length
   implicit none
   integer, intent(in) :: ndim, icp(*), ijac
   real(dp), intent(in) :: u(ndim), par(*)
   real(dp), intent(out) :: f(ndim)
   real(dp), intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
   real(dp), parameter :: length = 2*half_length
   real(dp) :: df(10, 10), R(3, 3), J(3, 4), torque(3)
   integer :: i

   call rod_rhs(law, u(1:4), u(5:7), [0._dp, par(2), par(3)], ijac > 0, f, df)
   call directors(u(1:4), R)
   torque = -u(10)*R(1, :)                                            ! R^t t
   f(1:4) = f(1:4) + par(4)*u(1:4)
   f(5:7) = f(5:7) + par(5)*torque
   f = length*f
   if (ijac == 0) return
   call transposed_times(u(1:4), [-u(10), 0._dp, 0._dp], J)
   dfdu(:, 1:7) = length*df(:, 1:7)
   dfdu(:, 8:10) = 0
   do i = 1, 4
      dfdu(i, i) = dfdu(i, i) + length*par(4)
   end do
   dfdu(5:7, 1:4) = dfdu(5:7, 1:4) + length*par(5)*J
   dfdu(5:7, 10) = -length*par(5)*R(1, :)
   if (ijac == 1) return
   dfdp(:, 1:5) = 0
   dfdp(:, 2:3) = length*df(:, 9:10)
   dfdp(1:4, 4) = length*u(1:4)
   dfdp(5:7, 5) = length*torque
end subroutine

subroutine stpnt(ndim, u, par, t)
   use rod, only: dp
   use hemitropic_law, only: half_length
   implicit none
   integer, intent(in) :: ndim
   real(dp), intent(inout) :: u(ndim), par(*)
   real(dp), intent(in) :: t
   par(1:5) = 0
   u = [1._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp, 0._dp, half_length*(2*t - 1)]
end subroutine

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
   use rod, only: dp, held
   use hemitropic_law, only: half_length
   implicit none
   integer, intent(in) :: ndim, icp(*), nbc, ijac
   real(dp), intent(in) :: par(*), u0(ndim), u1(ndim)
   real(dp), intent(out) :: fb(nbc)
   real(dp), intent(inout) :: dbc(nbc, *)
   integer, parameter :: clamped(7) = [1, 2, 3, 4, 8, 9, 10]
   call held(clamped, clamped, 5, u0, u1, fb, ijac, dbc)
   fb([1, 8]) = fb([1, 8]) - 1
   fb(7) = fb(7) + half_length*(1 - par(1))
   fb(14) = fb(14) - half_length*(1 - par(1))
   if (ijac == 2) dbc([7, 14], 2*ndim + 1) = [-half_length, half_length]
end subroutine

subroutine pvls
end subroutine
