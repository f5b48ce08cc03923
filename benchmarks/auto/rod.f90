! An unshearable Cosserat rod without distributed loads, as ordinary differential equations in arclength.
!
!   q' = 1/2 q (0, k)            q: quaternion of the directors, k: curvatures and twist in the body frame
!   m' = - k x m - (0,0,v) x n   m: contact moment in the body frame, n = R(q)^t N: contact force in the body frame
!   r' = v d3                    r: centreline, d3: third column of R(q), v: stretch
!
! N, the contact force in space, is constant: no force acts along the rod. A scene supplies the inverse of its
! constitutive law, (m, n3) -> (k, v), with derivatives; what is here is the same for every scene.
! R is not divided by |q|^2: collocation at Gauss points keeps |q| = 1 exactly at the mesh points.
module rod
   implicit none
   private
   public :: dp, directors, transposed_times, rod_rhs, held

   integer, parameter :: dp = kind(1d0)

   abstract interface
      pure subroutine inverse_law(m, n3, k, v, dk, dv)
         ! k, v and their derivatives with respect to (m1, m2, m3, n3).
         import :: dp
         real(dp), intent(in) :: m(3), n3
         real(dp), intent(out) :: k(3), v, dk(3, 4), dv(4)
      end subroutine
   end interface

contains

   pure subroutine directors(q, R)
      ! The columns of R are d1, d2, d3.
      real(dp), intent(in) :: q(4)
      real(dp), intent(out) :: R(3, 3)
      real(dp) :: a, b, c, d
      a = q(1); b = q(2); c = q(3); d = q(4)
      R(:, 1) = [a*a + b*b - c*c - d*d, 2*(b*c + a*d), 2*(b*d - a*c)]
      R(:, 2) = [2*(b*c - a*d), a*a - b*b + c*c - d*d, 2*(c*d + a*b)]
      R(:, 3) = [2*(b*d + a*c), 2*(c*d - a*b), a*a - b*b - c*c + d*d]
   end subroutine

   pure subroutine transposed_times(q, w, J)
      ! J = d(R(q)^t w)/dq for a constant vector w.
      real(dp), intent(in) :: q(4), w(3)
      real(dp), intent(out) :: J(3, 4)
      real(dp) :: t, u(3)
      t = 2*dot_product(q(2:4), w)                                    ! R^t w = (a^2 - u.u) w + 2 (u.w) u - 2 a u x w,
      u = q(2:4)                                                      ! q = (a, u)
      J(:, 1) = 2*q(1)*w - 2*[u(2)*w(3) - u(3)*w(2), u(3)*w(1) - u(1)*w(3), u(1)*w(2) - u(2)*w(1)]
      J(:, 2) = -2*u(1)*w + 2*w(1)*u + [t, -2*q(1)*(-w(3)), -2*q(1)*w(2)]
      J(:, 3) = -2*u(2)*w + 2*w(2)*u + [-2*q(1)*w(3), t, -2*q(1)*(-w(1))]
      J(:, 4) = -2*u(3)*w + 2*w(3)*u + [-2*q(1)*(-w(2)), -2*q(1)*w(1), t]
   end subroutine

   pure subroutine rod_rhs(law, q, m, force, jacobian, f, df)
      ! f = (q', m', r'); with jacobian, df = df/d(q, m, N), ten by ten.
      procedure(inverse_law) :: law
      real(dp), intent(in) :: q(4), m(3), force(3)
      logical, intent(in) :: jacobian
      real(dp), intent(out) :: f(10)
      real(dp), intent(out) :: df(10, 10)
      real(dp) :: R(3, 3), n(3), k(3), v, dk(3, 4), dv(4), Q3(4, 3), dn(3, 10), dky(3, 10), dvy(10)
      integer :: i

      call directors(q, R)
      n = matmul(force, R)
      call law(m, n(3), k, v, dk, dv)
      Q3(:, 1) = 0.5_dp*[-q(2), q(1), q(4), -q(3)]                    ! the columns of k -> 1/2 q (0, k)
      Q3(:, 2) = 0.5_dp*[-q(3), -q(4), q(1), q(2)]
      Q3(:, 3) = 0.5_dp*[-q(4), q(3), -q(2), q(1)]
      f(1:4) = matmul(Q3, k)
      f(5) = m(2)*k(3) - m(3)*k(2) + v*n(2)
      f(6) = m(3)*k(1) - m(1)*k(3) - v*n(1)
      f(7) = m(1)*k(2) - m(2)*k(1)
      f(8:10) = v*R(:, 3)
      if (.not. jacobian) return

      call transposed_times(q, force, dn(:, 1:4))
      dn(:, 5:7) = 0
      dn(:, 8:10) = transpose(R)
      do i = 1, 10                                                    ! derivatives of k and v by the chain rule
         dky(:, i) = dk(:, 4)*dn(3, i)
         dvy(i) = dv(4)*dn(3, i)
      end do
      dky(:, 5:7) = dky(:, 5:7) + dk(:, 1:3)
      dvy(5:7) = dvy(5:7) + dv(1:3)

      df(1:4, :) = matmul(Q3, dky)
      df(1, 2:4) = df(1, 2:4) - 0.5_dp*k                              ! and 1/2 q (0, k) with respect to q
      df(2, 1:4) = df(2, 1:4) + 0.5_dp*[k(1), 0._dp, k(3), -k(2)]
      df(3, 1:4) = df(3, 1:4) + 0.5_dp*[k(2), -k(3), 0._dp, k(1)]
      df(4, 1:4) = df(4, 1:4) + 0.5_dp*[k(3), k(2), -k(1), 0._dp]
      df(5, :) = m(2)*dky(3, :) - m(3)*dky(2, :) + v*dn(2, :) + n(2)*dvy
      df(6, :) = m(3)*dky(1, :) - m(1)*dky(3, :) - v*dn(1, :) - n(1)*dvy
      df(7, :) = m(1)*dky(2, :) - m(2)*dky(1, :)
      df(5, 6:7) = df(5, 6:7) + [k(3), -k(2)]
      df(6, 5:7) = df(6, 5:7) + [-k(3), 0._dp, k(1)]
      df(7, 5:6) = df(7, 5:6) + [k(2), -k(1)]
      do i = 1, 10
         df(8:10, i) = R(:, 3)*dvy(i)
      end do
      ! d3 = R e3 with respect to q
      df(8, 1:4) = df(8, 1:4) + 2*v*[q(3), q(4), q(1), q(2)]
      df(9, 1:4) = df(9, 1:4) + 2*v*[-q(2), -q(1), q(4), q(3)]
      df(10, 1:4) = df(10, 1:4) + 2*v*[q(1), -q(2), -q(3), q(4)]
   end subroutine

   pure subroutine held(left, right, npar, u0, u1, fb, ijac, dbc)
      ! Boundary conditions u0(left) = 0, u1(right) = 0, to which a scene adds what is not zero; with ijac = 1 their
      ! derivatives in u0, u1, with ijac = 2 also the (zero) ones in npar parameters.
      integer, intent(in) :: left(:), right(:), npar, ijac
      real(dp), intent(in) :: u0(:), u1(:)
      real(dp), intent(out) :: fb(:)
      real(dp), intent(inout) :: dbc(size(fb), *)
      integer :: i, n
      n = size(u0)
      fb(:size(left) + size(right)) = [u0(left), u1(right)]
      if (ijac == 0) return
      dbc(:, 1:2*n) = 0
      do i = 1, size(left)
         dbc(i, left(i)) = 1
      end do
      do i = 1, size(right)
         dbc(size(left) + i, n + right(i)) = 1
      end do
      if (ijac == 2) dbc(:, 2*n + 1:2*n + npar) = 0
   end subroutine

end module rod
