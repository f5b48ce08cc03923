! The hemitropic rod of half length l = 3, unshearable, with the stored energy
!
!   W = D/2 (v - 1)^2 + A (v - 1) k3 + B/2 k3^2 + C/2 (k1^2 + k2^2),     (D, A, B, C) = (10, -3, 1, 1),
!
! that is n3 = D (v - 1) + A k3, m3 = A (v - 1) + B k3, m1 = C k1, m2 = C k2; here solved for k and v.
module hemitropic_law
   use rod, only: dp
   implicit none
   real(dp), parameter :: half_length = 3, D = 10, A = -3, B = 1, C = 1, det = D*B - A*A
contains
   pure subroutine law(m, n3, k, v, dk, dv)
      real(dp), intent(in) :: m(3), n3
      real(dp), intent(out) :: k(3), v, dk(3, 4), dv(4)
      k = [m(1)/C, m(2)/C, (D*m(3) - A*n3)/det]
      v = 1 + (B*n3 - A*m(3))/det
      dk = 0; dk(1, 1) = 1/C; dk(2, 2) = 1/C; dk(3, 3) = D/det; dk(3, 4) = -A/det
      dv = [0._dp, 0._dp, -A/det, B/det]
   end subroutine
end module hemitropic_law
