! Follower load, vibrations about the straight rod in its weak plane (EI = 1, mass 1, no rotary inertia):
!
!   w'''' + P w'' = mu w,   w(0) = w'(0) = 0,   w''(1) = w'''(1) = 0,   mu = omega^2.
!
! AUTO has no eigenvalue solver for boundary value problems and does not linearise: this problem, derived by hand, is
! itself continued, the eigenfunction scaled to w(1) = 1, with mu as second parameter. Two eigenvalues collide (flutter)
! where the curve mu(P) has a fold.
!
!   unknowns   w, w', w'', w''' + P w'                        parameters   1 P   2 mu
!
! Free: P and 5 - 4 = 1 more. It starts from the first mode of the cantilever at P = 0, mu = beta^4.
subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
   implicit none
   integer, parameter :: dp = kind(1d0)
   integer, intent(in) :: ndim, icp(*), ijac
   real(dp), intent(in) :: u(ndim), par(*)
   real(dp), intent(out) :: f(ndim)
   real(dp), intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)

   f = [u(2), u(3), u(4) - par(1)*u(2), par(2)*u(1)]
   if (ijac == 0) return
   dfdu = 0
   dfdu(1, 2) = 1
   dfdu(2, 3) = 1
   dfdu(3, 2) = -par(1)
   dfdu(3, 4) = 1
   dfdu(4, 1) = par(2)
   if (ijac == 1) return
   dfdp(:, 1) = [0._dp, 0._dp, -u(2), 0._dp]
   dfdp(:, 2) = [0._dp, 0._dp, 0._dp, u(1)]
end subroutine

subroutine stpnt(ndim, u, par, t)
   implicit none
   integer, parameter :: dp = kind(1d0)
   integer, intent(in) :: ndim
   real(dp), intent(inout) :: u(ndim), par(*)
   real(dp), intent(in) :: t
   real(dp), parameter :: beta = 1.8751040687119611664_dp             ! cos(beta) cosh(beta) = -1
   real(dp) :: x, g
   x = beta*t
   g = (cosh(beta) + cos(beta))/(sinh(beta) + sin(beta))
   u(1) = 0.5_dp*(cosh(x) - cos(x) - g*(sinh(x) - sin(x)))
   u(2) = 0.5_dp*beta*(sinh(x) + sin(x) - g*(cosh(x) - cos(x)))
   u(3) = 0.5_dp*beta**2*(cosh(x) + cos(x) - g*(sinh(x) + sin(x)))
   u(4) = 0.5_dp*beta**3*(sinh(x) - sin(x) - g*(cosh(x) + cos(x)))
   par(1:2) = [0._dp, beta**4]
end subroutine

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
   implicit none
   integer, parameter :: dp = kind(1d0)
   integer, intent(in) :: ndim, icp(*), nbc, ijac
   real(dp), intent(in) :: par(*), u0(ndim), u1(ndim)
   real(dp), intent(out) :: fb(nbc)
   real(dp), intent(inout) :: dbc(nbc, *)
   fb = [u0(1), u0(2), u1(3), u1(4) - par(1)*u1(2), u1(1) - 1]
   if (ijac == 0) return
   dbc(:, 1:2*ndim) = 0
   dbc(1, 1) = 1
   dbc(2, 2) = 1
   dbc(3, ndim + 3) = 1
   dbc(4, ndim + 4) = 1
   dbc(4, ndim + 2) = -par(1)
   dbc(5, ndim + 1) = 1
   if (ijac == 1) return
   dbc(:, 2*ndim + 1:2*ndim + 2) = 0
   dbc(4, 2*ndim + 1) = -u1(2)
end subroutine

subroutine pvls
end subroutine
